"""Dissipative forces and hysteresis."""
