"""Rate-independent hysteresis: compiled kernels and frozen models."""
