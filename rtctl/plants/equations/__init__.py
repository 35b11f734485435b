"""Equations of a user as a kind of plant."""
