"""Least-squares solvers and the inference at their minimum."""
