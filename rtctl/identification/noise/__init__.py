"""Noise models of residuals: autoregression, slow noise."""
