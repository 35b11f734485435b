"""Working range of a model: the currents between which more current means more deflection.

Thermal expansion bends the beam against the transition, so deflection falls again with current beyond both ends of
the transition: there a PI of fixed sign would push the wrong way and stay. The working range runs from the minimum of
the cooling branch before the transition to the maximum of the heating branch after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.models.span import Span


class WorkingRange(NamedTuple):
    """Currents [mA], deflections [um] and steepest slope [um/mA] of the controllable part of the major loop."""

    current: Span
    deflection: Span
    steepest_slope: float


def working_range(deflection: PreisachModel, current: Span, points: int = 400) -> WorkingRange:
    """Return the range from the major loop of v -> deflection. Raises ValueError where the model never rises."""
    v = np.linspace(current.low, current.high, points)
    loop = deflection.simulate(np.concatenate(([0.0], v, v[::-1])))[1:]
    heating, cooling = loop[:points], loop[points:][::-1]
    # the largest rise from an earlier cooling to a later heating current; a fall beyond both ends may be deeper
    high = int(np.argmax(heating - np.minimum.accumulate(cooling)))
    low = int(np.argmin(cooling[: high + 1]))
    if not low < high:
        raise ValueError("the deflection model falls with current: there is no range to control it in")
    window = max(1, points // 100)  # over 1 % of the range: a single cell of the grid is not a slope
    rise = max(
        float(np.max(branch[low : high + 1][window:] - branch[low : high + 1][:-window], initial=-np.inf))
        for branch in (heating, cooling)
    )
    if not rise > 0.0:
        raise ValueError(
            "the deflection model rises over less than 1 % of the current range: a step, not a slope"
        )
    slope = rise / (window * float(v[1] - v[0]))
    return WorkingRange(
        Span(float(v[low]), float(v[high])), Span(float(cooling[low]), float(heating[high])), slope
    )
