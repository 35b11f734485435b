"""Identification of equations of a user."""
