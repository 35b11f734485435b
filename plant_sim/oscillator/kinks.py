"""What a response does within each sample period, where its drive bends or jumps at the samples.

An acceleration does as its drive does, and so does an output of equations with an input in it. A filter behind it needs
its values and slopes on either side of a sample: with a central difference across a kink, or a line across a jump, a
short lag was off by 2 to 38 % of its effect.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

CUBIC = np.array([4.0, -6.0, 4.0, -1.0])
"""Weights of four equidistant values, the nearest first, of the cubic through them one step beyond."""
LEAST = len(CUBIC)
"""Instants in a sample period, least, that tell what a response does in it."""


class Kinks(NamedTuple):
    """Where a response has kinks."""

    every: int
    """Instants from one to the next, `LEAST` at least."""
    jumps: bool
    """Whether its value may jump there, too."""
    after: bool
    """Whether the value there is that after the jump."""


def kinks_of(begins: FloatArray, ends: FloatArray, steps: int, every: int, *, after: bool) -> Kinks:
    """Return the kinks under a drive that begins and ends each step so (all steps, ...).

    Args:
        begins: Drive at the start of each step.
        ends: Drive at its end.
        steps: Steps in a sample period.
        every: Instants in a sample period.
        after: Whether the response at a sample is that after a jump.
    """
    jumps = bool((ends[steps - 1 : -1 : steps] != begins[steps::steps]).any())
    return Kinks(every, jumps, after)


class Pieces(NamedTuple):
    """Values and slopes (n - 1,) at the start and at the end of the intervals between n instants."""

    start: FloatArray
    start_slope: FloatArray
    end: FloatArray
    end_slope: FloatArray


def pieces(values: FloatArray, kinks: Kinks) -> Pieces:
    """Return the pieces of a response (n,); slopes are per interval, by parabolas that cross no kink."""
    count = (len(values) - 1) // kinks.every
    blocks = np.empty((count, kinks.every + 1))
    blocks[:, :-1] = values[: count * kinks.every].reshape(count, kinks.every)
    blocks[:, -1] = values[kinks.every : count * kinks.every + 1 : kinks.every]
    if kinks.jumps and kinks.after:
        blocks[:, -1] = blocks[:, -2:-6:-1] @ CUBIC
    elif kinks.jumps:
        blocks[1:, 0] = blocks[1:, 1:5] @ CUBIC
    slopes: FloatArray = np.asarray(np.gradient(blocks, axis=1, edge_order=2))
    parts = blocks[:, :-1], slopes[:, :-1], blocks[:, 1:], slopes[:, 1:]
    return Pieces(*(np.ascontiguousarray(one).reshape(-1) for one in parts))
