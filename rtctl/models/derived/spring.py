"""Whether data show that a body has a spring: a stiffness that may be zero, or acts in no record, tells nothing.

A spring acts after a quarter of its period 2 pi / sqrt |k|, and on a body that is damped more than critically after its
time constant c / |k|.
"""

from __future__ import annotations

import math

from rtctl.border.statistics import NORMAL_95
from rtctl.border.units.quantities import convert
from rtctl.models.derived.quantity import Estimated

CERTAIN_ERRORS = 3.0
"""Standard errors by which a parameter is certainly different from zero."""
FAR_LONGER = 10.0
"""Period or time constant over the longest record from which on a spring hardly acts in it."""
LEAST_WELL_QUALITY = 0.5
"""Quality factor in a well below which nothing oscillates there, and no interval says that there is one."""


def is_certain(one: Estimated | None) -> bool:
    """Return whether an estimate is certainly different from zero; where no interval is known, whether it is not 0."""
    if one is None or one.value == 0.0:
        return False
    return abs(one.value) > CERTAIN_ERRORS / NORMAL_95 * 0.5 * (one.high - one.low)


def has_interval(one: Estimated) -> bool:
    """Return whether an interval is known."""
    return one.high > one.low


def is_spring(stiffness: Estimated | None, damping: Estimated | None, longest_s: float = 0.0) -> bool:
    """Return whether a stiffness, of either sign, is certainly not zero and acts within records.

    Args:
        stiffness: Stiffness per mass; None: the model has none.
        damping: Damping per mass; None: the model has none.
        longest_s: Duration of the longest record [s]; 0: not known.
    """
    if stiffness is None or not is_certain(stiffness):
        return False
    size = abs(convert(stiffness.value, stiffness.unit, "1/s**2"))
    lag = 0.0 if damping is None else convert(damping.value, damping.unit, "1/s") / size
    return not longest_s > 0.0 or max(2.0 * math.pi / math.sqrt(size), lag) <= FAR_LONGER * longest_s


def is_well(stiffness: Estimated, damping: Estimated | None) -> bool:
    """Return whether a negative stiffness that `is_spring` makes wells; without an interval, by whether it oscillates.

    In a well of a cubic spring the stiffness is twice as large and positive.
    """
    if has_interval(stiffness) or damping is None:
        return True
    rate = math.sqrt(2.0 * abs(convert(stiffness.value, stiffness.unit, "1/s**2")))
    return rate > LEAST_WELL_QUALITY * convert(damping.value, damping.unit, "1/s")
