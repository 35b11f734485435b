"""Residual analysis: noise model, projected directions, tests, localization of the gap."""
