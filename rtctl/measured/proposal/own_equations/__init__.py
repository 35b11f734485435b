"""Datasets of a model of one's own equations, whose signals no kind of plant names."""
