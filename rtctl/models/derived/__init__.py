"""Quantities that follow from a model, in the terms of those who use the device."""
