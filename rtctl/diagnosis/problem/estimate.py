"""An estimate of a parameter with its interval."""

from __future__ import annotations

from typing import NamedTuple


class Estimate(NamedTuple):
    """A parameter of a model with its 95 % interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str
