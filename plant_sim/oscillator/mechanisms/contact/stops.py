"""What stops on one side and on both have in common: how far they are searched, their damper, their rate."""

from __future__ import annotations

import math

from plant_sim.oscillator.mechanism import RELAXATION, shape
from rtctl.border.mechanisms import Parameter

MOST_OF_A_STOP = 20.0
"""Times as far as usual is a stop's stiffness searched: 100 times the device's own."""
DAMPER = "The contact has a damper too, with a retardation time (damper over spring) of {retardation_time}."
RETARDATION = 0.1
"""Retardation time that matters, in parts of a radian of the motion: a twentieth of critical damping where the stop is
as stiff as the device, a tenth where it is four times as stiff."""


def retardation_time(whose: str) -> Parameter:
    """Declare the retardation time of a stop: its damper over its spring (Kelvin, Voigt); 0: it is elastic."""
    return shape(
        "retardation_time", "s", f"of {whose}: its damper over its spring; 0: elastic",
        lambda s: RETARDATION / s.rate, default=0.0, simplest=0.0, smooth=True, low=0.0, shape_range=(0.0, 30.0),
    )  # fmt: skip


def rate_of_a_stop(stiffness: float, retardation_s: float) -> float:
    """Return what a stop of `stiffness` [1/s^2] adds to the rate [1/s] that an integrator resolves."""
    return math.hypot(math.sqrt(stiffness), RELAXATION * retardation_s * stiffness)
