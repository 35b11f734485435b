"""Envelopes of a generalised play: gamma_R = tanh(a_R v + b_R), gamma_L = tanh(a_L v + b_L) (eqs. 16-17).

R is the heating (rising, lower) edge, L the cooling (falling, upper) one; -b/a is the centre of a branch in
the unit of v. Order preservation gamma_R - r <= gamma_L + r must hold on the whole range: two tanh of
unequal slopes cross somewhere, so it is a property of envelopes and range together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import atanh, tanh
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel

EnvelopeLines = tuple[FloatArray, FloatArray] | tuple[float, float]

_CHECKED_POINTS = 2001
_ORDER_TOLERANCE = 1e-7  # of envelopes that span 2: a crossing in saturation, below any converter's step


class Line(NamedTuple):
    """Argument a v + b of one tanh: a [1/unit of v], b [-]."""

    a: float
    b: float


@kernel
def envelope(a: float, b: float, v: float) -> float:
    """Return gamma(v) = tanh(a v + b)."""
    return tanh(a * v + b)


@kernel
def envelope_slope(a: float, gamma: float) -> float:
    """Return d gamma / dv = a (1 - gamma^2) at the value gamma."""
    return a * (1.0 - gamma) * (1.0 + gamma)


@kernel
def envelope_inverse(a: float, b: float, gamma: float) -> float:
    """Return v = (arctanh(gamma) - b) / a, for |gamma| < 1."""
    return (atanh(gamma) - b) / a


def crossing_depth(
    heating: EnvelopeLines,
    cooling: EnvelopeLines,
    r: FloatArray,
    v_range: tuple[float, float],
) -> FloatArray:
    """Return how far order preservation is broken: max over v of gamma_R - gamma_L - 2 r, shape (n,); <= 0 is in order.

    It is judged on a grid of the envelopes themselves: lines of unequal slope always cross somewhere, and where both
    tanh have saturated their crossing moves nothing.

    Args:
        heating: (a_R, b_R), each (n,) or common to all plays.
        cooling: (a_L, b_L), each (n,) or common to all plays.
        r: (n,) radii.
        v_range: Lowest and highest v.
    """
    v = np.linspace(*v_range, _CHECKED_POINTS)[:, None]
    x_R, x_L = heating[0] * v + heating[1], cooling[0] * v + cooling[1]
    depth: FloatArray = np.max(np.tanh(x_R) - np.tanh(x_L), axis=0) - 2.0 * r
    return depth


def check_order(
    heating: EnvelopeLines,
    cooling: EnvelopeLines,
    r: FloatArray,
    v_range: tuple[float, float],
) -> None:
    """Raise ValueError unless the range is valid, every envelope rises (a > 0) and no play breaks the order."""
    low, high = v_range
    if not low < high:
        raise ValueError(f"v_low = {low:g} must be below v_high = {high:g}")
    for name, a in (("a_R", heating[0]), ("a_L", cooling[0])):
        if not np.all(np.greater(a, 0.0)):
            raise ValueError(
                f"{name} must be > 0, got {np.min(a):g}: model the negative of a falling quantity"
            )
    if not (r >= 0.0).all():
        raise ValueError(f"radii r must be >= 0, got {r.min():g}")
    depth = crossing_depth(heating, cooling, r, v_range)
    worst = int(depth.argmax())
    if depth[worst] > _ORDER_TOLERANCE:
        raise ValueError(
            f"play {worst}: gamma_R - r exceeds gamma_L + r by {depth[worst]:.3g} in {low:g} to {high:g}; "
            "move the cooling envelope up or narrow the range"
        )


def cooling_line(heating: Line, gaps: tuple[float, float], v_range: tuple[float, float]) -> Line:
    """Return the cooling envelope that lies `gaps` >= 0 above the heating one at the ends of the range.

    The gap parametrisation of an identification: gaps are differences of the tanh arguments [-] at
    `v_range`; with both >= 0 the order holds on the whole range for every play. Raises ValueError for a
    negative gap.
    """
    if not min(gaps) >= 0.0:
        raise ValueError(f"gaps of the tanh arguments must be >= 0 at both ends of the range, got {gaps}")
    slope = (gaps[1] - gaps[0]) / (v_range[1] - v_range[0])
    return Line(heating.a + slope, heating.b + gaps[0] - slope * v_range[0])
