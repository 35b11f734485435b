"""Mechanisms of the heat balance and of the heater."""
