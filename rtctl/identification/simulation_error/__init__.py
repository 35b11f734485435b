"""Simulation-error fits: output error, multiple shooting, sensitivities."""
