"""A VO2 actuator that is doubted while it runs: its free run, what may have changed, a model with it."""
