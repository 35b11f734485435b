"""Mechanisms of the instants at which readings are taken."""
