"""Measured data to a model: staircases to hysteresis models, step responses to the heating's time constant."""
