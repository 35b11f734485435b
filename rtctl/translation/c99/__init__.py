"""Translated kernels as C99."""
