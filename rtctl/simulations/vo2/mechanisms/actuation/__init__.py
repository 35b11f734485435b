"""Mechanisms between the command and the film, and of the structure."""
