"""Kernels in Python, read as a small typed language: which functions, which types, what they change in place."""
