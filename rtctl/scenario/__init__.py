"""Scenario files: their tables, checked, and the command sequence that they describe."""
