"""Outputs that are difference quotients of another one, row by row: they hold nothing but that one and its noise.

Who has a displacement often adds a velocity by `gradient` or `diff`. As a second reading it would count as one more
instrument, whose noise grows with frequency, is that of the first, and whose quotient is no velocity of the model.
What tells it: it differs from the quotient by the last digit of the file, and not by a noise.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record

SOURCES = {"velocity": ("displacement",), "acceleration": ("velocity", "displacement")}
"""Outputs of an oscillator that another one gives, the nearest first."""
ONCE: tuple[tuple[float, ...], ...] = ((0.5, 0.0, -0.5), (1.0, -1.0, 0.0), (0.0, 1.0, -1.0))
"""Difference quotients by the rows k + 1, k, k - 1: `gradient`, forward and backward `diff`."""
TWICE: tuple[tuple[float, ...], ...] = ((1.0, -2.0, 1.0), (0.25, 0.0, -0.5, 0.0, 0.25))
"""Second ones: of neighbours, and `gradient` of `gradient`."""
MOST_ROWS = 20_000
"""Rows that are looked at."""
LEAST_ROWS = 100
MOST_OF_NOISE = 0.2
"""Largest difference (RMS) from a quotient, over the reading's own noise, by which an instrument of its own differs at
least."""


class QuotientEvidence:
    """What records show, one after the other: an output is a quotient where it is so in all of them."""

    def __init__(self) -> None:
        self._sources: dict[str, tuple[str, ...]] = {}

    def see(self, record: Record) -> None:
        """Take in a record."""
        if record.is_sweep:
            return
        for name, sources in SOURCES.items():
            if record.has(name):
                left = self._sources.get(name, sources)
                self._sources[name] = tuple(source for source in left if _is_quotient(record, name, source))

    @property
    def left_out(self) -> dict[str, str]:
        """Outputs that hold nothing of their own, and what each is a quotient of."""
        return {name: sources[0] for name, sources in self._sources.items() if sources}


def _is_quotient(record: Record, name: str, source: str) -> bool:
    """Return whether the output `name` of a record is a difference quotient of `source`, which it may lack."""
    if not record.has(source):
        return False
    y, x = record.signals[name][:MOST_ROWS], record.signals[source][:MOST_ROWS]
    twice = (name, source) == ("acceleration", "displacement")
    if len(y) < LEAST_ROWS or not (np.isfinite(y).all() and np.isfinite(x).all()):
        return False
    noise = _noise(y)
    if not noise > 0.0:
        return False
    inner = slice(3, -3)
    for kernel in TWICE if twice else ONCE:
        quotient = np.convolve(x, kernel, mode="same") / record.period_s ** (2 if twice else 1)
        if float(np.sqrt(np.mean((y - quotient)[inner] ** 2))) < MOST_OF_NOISE * noise:
            return True
    return False


def _noise(y: FloatArray) -> float:
    """Return the RMS of the noise of a reading (n,), were it white, by its third differences."""
    return float(np.sqrt(np.mean(np.diff(y, 3) ** 2) / 20.0))
