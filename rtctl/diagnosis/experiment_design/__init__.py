"""Isolability of mechanisms, and the next experiment that separates the remaining ones."""
