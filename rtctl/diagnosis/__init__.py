"""Measured data and today's model: what the simulation gets wrong, its cause by name, the model with it, the gain."""
