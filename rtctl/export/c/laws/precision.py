"""Constants that depend on the precision: tolerances of an iteration, which end it where rounding begins."""

from __future__ import annotations


class ByPrecision(float):
    """A constant of double precision that has another value in single precision."""

    single: float


def by_precision(double: float, single: float) -> ByPrecision:
    """Return the constant."""
    made = ByPrecision(double)
    made.single = single
    return made
