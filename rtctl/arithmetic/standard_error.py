"""Independent errors together."""

from __future__ import annotations

import math

from rtctl.border.kernels import kernel


@kernel
def combined(one: float, other: float) -> float:
    """Return the standard deviation of a sum of two independent errors."""
    return math.sqrt(one * one + other * other)
