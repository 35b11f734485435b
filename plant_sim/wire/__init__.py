"""Servers that put a simulated device on a wire."""
