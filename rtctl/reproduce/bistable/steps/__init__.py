"""Steps of the bistable-beam study, one figure or table a module."""
