"""Restoring forces, and a second mode."""
