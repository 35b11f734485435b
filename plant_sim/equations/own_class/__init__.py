"""A device as a Python class: the tables of a model file, with compiled functions in the place of its expressions."""
