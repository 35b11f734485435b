"""Steps of the VO2 study, one figure or table a module."""
