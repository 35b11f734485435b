"""Model files: the assumptions of simulation, estimator and tuning about a device."""
