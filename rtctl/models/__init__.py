"""Model files: what the simulation, the estimator and the tuning believe of a device."""
