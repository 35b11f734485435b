"""Identification of VO2 actuators: staircases to hysteresis models, transients to the heating."""
