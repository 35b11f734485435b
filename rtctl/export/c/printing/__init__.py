"""Translated kernels as text: C99, and Python in single precision."""
