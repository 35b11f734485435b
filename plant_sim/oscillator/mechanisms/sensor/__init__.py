"""Mechanisms of the reading, be it of the displacement, the velocity or the acceleration."""
