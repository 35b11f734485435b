"""Mechanisms of the resistance reading."""
