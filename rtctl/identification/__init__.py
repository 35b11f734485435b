"""Measured data to a model: a vo2's hysteresis read-outs and heating, an oscillator's parameters."""
