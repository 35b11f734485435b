"""Simulated hardware: plants with their own physics, behind the register semantics of a real device."""
