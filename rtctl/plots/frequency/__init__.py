"""Figures over frequency: amplitude and phase."""
