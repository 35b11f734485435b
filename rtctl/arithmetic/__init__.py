"""Arithmetic of the kernels that gives the same bits everywhere."""
