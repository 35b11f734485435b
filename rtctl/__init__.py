"""Feedback control of actuators that sense themselves."""

from rtctl.registry import register

__version__ = "0.2.0"

__all__ = ["__version__", "register"]
