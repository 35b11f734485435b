"""Checks of the data before any fit: length, excitation, spikes, clipping, initial state."""
