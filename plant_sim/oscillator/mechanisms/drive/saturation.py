"""`drive.saturation`: as a magnetisation does or as an amplifier at its supply.

3 L(x) / sqrt(curvature), x = sqrt(curvature) u, L(x) = coth x - 1 / x (Langevin)
no more than +-limit
"""

from __future__ import annotations

import math

import numpy as np

from plant_sim.oscillator.integration.holds import compiled
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient, shape
from rtctl.border.arrays import FloatArray

SMALL = 0.5
"""Argument below which coth x - 1 / x loses digits: 3e-16 / x^2 of the drive."""
SERIES = (
    -349222 / 510443155096875, 87734 / 12993098493375, -3617 / 54273594375, 4 / 6081075, -1382 / 212837625,
    2 / 31185, -1 / 1575, 2 / 315, -1 / 15, 1.0,
)  # fmt: skip
"""Coefficients of 3 L(x) / x in powers of x^2, the highest first."""


def saturated(drive: Driven, p: Values) -> Driven:
    """Return the drive as a magnetisation follows it, u (1 - curvature u^2 / 15 + ...), or cut off."""
    if p["curvature"] > 0.0 or p["clipped"] > 0.0:
        out = np.empty_like(drive.nodes)
        _saturate(drive.nodes, math.sqrt(p["curvature"]), p["clipped"], p["limit"], out)
        drive = drive._replace(nodes=out)
    return drive


@compiled
def bent(x: float) -> float:
    """Return 3 L(x) / x, by its series where x is small."""
    if abs(x) < SMALL:
        total = 0.0
        for c in SERIES:
            total = total * (x * x) + c
        return total
    e = math.exp(-2.0 * abs(x))
    return 3.0 * ((1.0 + e) / (1.0 - e) - 1.0 / abs(x)) / abs(x)


@compiled
def _saturate(nodes: FloatArray, root: float, clipped: float, limit: float, out: FloatArray) -> None:
    """Saturate every instant of `nodes` (steps, 3) once: most steps start where another ended, or are constant."""
    before = made = math.nan
    for i in range(len(nodes)):
        for c in range(3):
            u = nodes[i, c]
            if u != before:
                before, made = u, u * bent(root * u)
                made -= clipped * (made - min(max(made, -limit), limit))
            out[i, c] = made


MECHANISM = OscillatorMechanism(
    id="drive.saturation",
    statement=(
        "The drive saturates as a magnetisation does (Langevin), with a curvature of {curvature}, and a share of "
        "{clipped} of what is beyond {limit} is cut off."
    ),
    forms={
        "curvature": "The drive saturates as a magnetisation does (Langevin), with a curvature of {curvature}.",
        "clipped": (
            "The drive is clipped at {limit}, of either sign: a share of {clipped} of what is beyond does not act."
        ),
    },
    parameters=(
        coefficient(
            "curvature",
            "1/({u})^2",
            "inverse square of the drive at which it bends: u (1 - curvature u^2 / 15 + ...)",
            lambda s: 15.0 / s.drive**2,
            default=0.0,
            low=0.0,
        ),
        coefficient(
            "clipped",
            "dimensionless",
            "share of the drive beyond the limit that does not act; 1: none of it does",
            lambda s: 1.0,
            default=0.0,
            low=0.0,
            high=1.0,
        ),
        shape(
            "limit",
            "{u}",
            "beyond which less acts",
            lambda s: s.largest_drive,
            default=1.0,
            searched=True,
            shape_range=(0.15, 0.97),
            grid=7,
            of_form="clipped",
        ),
    ),
    drive=saturated,
    bends=True,
    stage=4,
)
