"""Oscillators in their steady state under a sine, frequency after frequency: what a lock-in amplifier reads."""
