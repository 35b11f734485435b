"""Verbs that work on measured data, models and studies."""
