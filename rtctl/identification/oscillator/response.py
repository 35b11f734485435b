"""What the fitted poles say of the kind of plant: one that hardly oscillates may be no oscillator.

Stages of the first order one after the other have real poles, so their quality factor sqrt(k) / c is at most 0.5.
Between that and 1 are a loudspeaker or a geophone, and a linear fit to stages that saturate or overflow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from rtctl.border.simulation import Simulation

MOST_QUALITY_OF_STAGES = 0.5
"""Largest quality factor of stages of the first order one after the other: their poles are real."""
CLEARLY_ABOVE = 1.1
"""Quality factor over that of such stages from which it is clearly above, where its error is not known."""
CLEAR_ERRORS = 3.0
"""Standard errors by which a quality factor is clearly above it."""
FIRST_ORDER = 10.0
"""Ratio of two real poles above which the faster one hardly shows: it delays by a tenth of the slower one's time."""
NO_RESONANCE = (
    "the fitted response hardly oscillates (quality factor {quality:.3g}, and not clearly above 0.5): is this an "
    "oscillator? Stages of the first order one after the other (tanks, heaters, filters) reach up to 0.5, and no cause "
    "of the catalogue describes such a plant: write its equations down and diagnose those (docs/equations.md)"
)
HARDLY_RINGS = (
    "the fitted response hardly rings (quality factor {quality:.3g}). A well damped oscillator does that (a "
    "loudspeaker, a geophone); so may stages of the first order that saturate, overflow or act on each other (tanks, "
    "heaters). If it is one of those, no cause of the catalogue describes it: write its equations down and diagnose "
    "those (docs/equations.md)"
)
RINGS = 1.0
"""Quality factor from which a response is that of an oscillator alone."""
NO_OSCILLATION = (
    "the fitted response does not oscillate: it is that of a plant of the first order with {slow:.3g} s{faster}. Is "
    "this an oscillator? No cause of the catalogue describes what acts in tanks, heaters or filters: write their "
    "equations down and diagnose those (docs/equations.md). Hysteresis that does not depend on the rate (a piezo, a "
    "magnetic core, dry friction) looks like such a lag too, as long as the drive has one frequency: records at two "
    "frequencies, ten times apart, tell them apart"
)
FASTER = ", and another stage with {fast:.3g} s"


def describe_response(simulation: Simulation, errors: Mapping[str, float] | None = None) -> str:
    """Return a sentence on a response that stages of the first order may have; "" where it rings, or at no spring.

    Args:
        simulation: Simulation of an oscillator at fitted values of "damping" [1/s] and "stiffness" [1/s^2].
        errors: Standard errors of these two, where they are known.
    """
    values = {one.name: one for one in simulation.parameters}
    damping, stiffness = values["damping"].value, values["stiffness"].value
    if values["stiffness"].fixed or not (stiffness > 0.0 and damping > 0.0):
        return ""
    quality = math.sqrt(stiffness) / damping
    if quality > MOST_QUALITY_OF_STAGES:
        relative = quality / MOST_QUALITY_OF_STAGES - 1.0
        least = CLEARLY_ABOVE - 1.0
        if errors and all(math.isfinite(errors.get(name, math.nan)) for name in ("damping", "stiffness")):
            own = math.hypot(0.5 * errors["stiffness"] / stiffness, errors["damping"] / damping)
            least = CLEAR_ERRORS * own * (relative + 1.0)
        if quality >= RINGS and relative > least:
            return ""
        return (HARDLY_RINGS if relative > least else NO_RESONANCE).format(quality=quality)
    root = math.sqrt(damping**2 / 4.0 - stiffness)
    fast, slow = damping / 2.0 + root, stiffness / (damping / 2.0 + root)
    faster = FASTER.format(fast=1.0 / fast) if fast < FIRST_ORDER * slow else ""
    return NO_OSCILLATION.format(slow=1.0 / slow, faster=faster)
