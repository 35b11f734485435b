"""Outputs that are difference quotients of another one, row by row: they hold nothing but that one and its noise.

Who has a displacement often adds a velocity by `gradient` or `diff`. As a second reading it would count as one more
instrument, whose noise grows with frequency, is that of the first, and whose quotient is no velocity of the model.
What tells it: it differs from the quotient by the last digit of the file, and not by a noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
LEFT_OUT = "{output} is the difference quotient of {source}, row by row: it holds nothing of its own, and is left out"


def leave_out_quotients(records: Sequence[Record]) -> tuple[tuple[Record, ...], dict[str, str]]:
    """Return the records without outputs that are difference quotients in all of them, and what each is one of."""
    found = {name: source for name in SOURCES if (source := _source_of(name, records)) is not None}
    if not found:
        return tuple(records), {}
    kept = [
        replace(one, signals={name: values for name, values in one.signals.items() if name not in found})
        for one in records
    ]
    return tuple(kept), found


def remarks_on_quotients(left_out: dict[str, str]) -> tuple[str, ...]:
    """Return what a user must know of outputs that are left out."""
    return tuple(LEFT_OUT.format(output=name, source=source) for name, source in left_out.items())


def _source_of(name: str, records: Sequence[Record]) -> str | None:
    """Return the output that `name` is a quotient of in all records that have it."""
    having = [one for one in records if one.has(name) and not one.is_sweep]
    for source in SOURCES[name]:
        if having and all(one.has(source) for one in having):
            twice = (name, source) == ("acceleration", "displacement")
            if all(
                _is_quotient(one.signals[name], one.signals[source], one.period_s, twice) for one in having
            ):
                return source
    return None


def _is_quotient(output: FloatArray, source: FloatArray, period_s: float, twice: bool) -> bool:
    y, x = output[:MOST_ROWS], source[:MOST_ROWS]
    if len(y) < LEAST_ROWS or not (np.isfinite(y).all() and np.isfinite(x).all()):
        return False
    noise = _noise(y)
    if not noise > 0.0:
        return False
    inner = slice(3, -3)
    for kernel in TWICE if twice else ONCE:
        quotient = np.convolve(x, kernel, mode="same") / period_s ** (2 if twice else 1)
        if float(np.sqrt(np.mean((y - quotient)[inner] ** 2))) < MOST_OF_NOISE * noise:
            return True
    return False


def _noise(y: FloatArray) -> float:
    """Return the RMS of the noise of a reading (n,), were it white, by its third differences."""
    return float(np.sqrt(np.mean(np.diff(y, 3) ** 2) / 20.0))
