"""Steps of the ME study, one figure or table a module."""
