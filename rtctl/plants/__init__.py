"""Kinds of plant: one folder each, with a light record in `kind.py` that the registry imports by name."""
