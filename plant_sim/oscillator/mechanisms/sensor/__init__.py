"""Mechanisms of the displacement reading."""
