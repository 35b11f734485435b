"""Integrators, and the drive between its samples."""
