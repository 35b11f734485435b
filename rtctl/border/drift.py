"""A drift from a record's start, steady or one that settles as a device warms up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.border.mechanisms import Parameter

STEADY = 0.0
"""Settling time of a drift that goes on and on."""


@kernel
def drifted_s(time_s: float, settling_s: float) -> float:
    """Return the drift at a time over its first rate [s]: d (1 - exp(-t / d)), and t where it is steady."""
    return time_s if settling_s == STEADY else -settling_s * math.expm1(-time_s / settling_s)


def drift_of(time_s: FloatArray, settling_s: float) -> FloatArray:
    """Return `drifted_s` at many times, of any shape."""
    return time_s if settling_s == STEADY else -settling_s * np.expm1(-time_s / settling_s)


def settling_time(**more: Any) -> Parameter:
    """Declare the time constant with which a drift settles; a steady one is tried by itself."""
    return Parameter(
        name="settling_time", unit="s", meaning="time constant with which the drift settles; 0: it does not",
        scale=lambda s: s.duration, neutral=None, default=STEADY, simplest=STEADY, low=0.0, shape_range=(0.1, 1.0),
        grid=2, **more,
    )  # fmt: skip
