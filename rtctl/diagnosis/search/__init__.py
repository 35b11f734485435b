"""Stepwise search over sets of mechanisms."""
