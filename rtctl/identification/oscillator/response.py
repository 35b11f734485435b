"""What the fitted poles say of the kind of plant: a response without a resonance may be no oscillator's."""

from __future__ import annotations

import math

from rtctl.border.simulation import Simulation

LEAST_QUALITY = 1.0
"""Quality factor below which a response hardly shows a resonance: its peak is 1.15 times its value at rest there, and
gone below 0.71."""
FIRST_ORDER = 10.0
"""Ratio of two real poles above which the faster one hardly shows: it delays by a tenth of the slower one's time."""
NO_RESONANCE = (
    "the fitted response hardly has a resonance (quality factor {quality:.2g}): is this an oscillator? Stages of "
    "the first order one after the other (tanks, heaters, filters) look like this, and no cause of the catalogue "
    "describes such a plant: write its equations down and diagnose those (docs/equations.md)"
)
NO_OSCILLATION = (
    "the fitted response does not oscillate: it is that of a plant of the first order with {slow:.3g} s{faster}. Is "
    "this an oscillator? No cause of the catalogue describes what acts in tanks, heaters or filters: write their "
    "equations down and diagnose those (docs/equations.md). Hysteresis that does not depend on the rate (a piezo, a "
    "magnetic core, dry friction) looks like such a lag too, as long as the drive has one frequency: records at two "
    "frequencies, ten times apart, tell them apart"
)
FASTER = ", and another stage with {fast:.3g} s"


def describe_response(simulation: Simulation) -> str:
    """Return a sentence on a response without a resonance; "" where there is one, or where no spring was measured.

    Args:
        simulation: Simulation of an oscillator at fitted values of "damping" [1/s] and "stiffness" [1/s^2].
    """
    values = {one.name: one for one in simulation.parameters}
    damping, stiffness = values["damping"].value, values["stiffness"].value
    if values["stiffness"].fixed or not (stiffness > 0.0 and damping > 0.0):
        return ""
    quality = math.sqrt(stiffness) / damping
    if quality >= LEAST_QUALITY:
        return ""
    if quality > 0.5:
        return NO_RESONANCE.format(quality=quality)
    root = math.sqrt(damping**2 / 4.0 - stiffness)
    fast, slow = damping / 2.0 + root, stiffness / (damping / 2.0 + root)
    faster = FASTER.format(fast=1.0 / fast) if fast < FIRST_ORDER * slow else ""
    return NO_OSCILLATION.format(slow=1.0 / slow, faster=faster)
