"""Feedback control of actuators that sense themselves."""

__version__ = "0.2.0"
