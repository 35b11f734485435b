"""Mechanisms of the phase transition."""
