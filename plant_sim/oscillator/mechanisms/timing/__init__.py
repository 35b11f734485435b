"""Mechanisms of the instants at which rows are read."""
