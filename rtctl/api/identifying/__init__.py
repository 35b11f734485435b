"""Identification in Python: from a dataset to a fitted model of its kind of plant."""
