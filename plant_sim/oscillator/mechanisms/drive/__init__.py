"""Mechanisms between the command and the force."""
