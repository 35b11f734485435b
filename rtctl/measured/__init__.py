"""Measured data: a manifest beside ordinary files becomes one checked in-memory form."""
