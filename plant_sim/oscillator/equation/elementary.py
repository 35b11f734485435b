"""Elementary functions of a law's velocity in arithmetic alone, so that the compiler works on several lanes at once.

exp(-x) = p(-x / 64)^64 with Taylor's polynomial p of order 7: off by 1e-12 at most, where the libraries' functions, one
lane at a time, take twice as long and keep all that stands beside them from being done for several lanes.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law

FARTHEST = 40.0
"""Exponent beyond which exp(-x) is nothing beside 1."""


@law
def fading(x: float) -> Any:
    """Return exp(-x) for x >= 0."""
    y = min(x, FARTHEST) / -64.0
    e = 1.0 + y * (
        1.0
        + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0 * (1.0 + y / 6.0 * (1.0 + y / 7.0)))))
    )
    for _ in range(6):
        e *= e
    return e


@law
def soft_sign(x: float) -> Any:
    """Return tanh x."""
    e = fading(2.0 * abs(x))
    size = (1.0 - e) / (1.0 + e)
    return size if x > 0.0 else -size
