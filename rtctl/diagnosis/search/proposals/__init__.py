"""Starts of larger sets: by the residual of a smaller one, and by the measured motion."""
