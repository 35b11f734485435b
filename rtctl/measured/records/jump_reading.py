"""Whether rows of an acceleration are read just after a held drive jumps at them, or just before.

A converter that writes its output and then reads its input, and most simulations, give the acceleration after the jump:
z''(k) has the drive of row k. Read before it, z''(k) has that of row k - 1. The difference is gain times the jump: a
few percent of the motion where a drive is finely sampled, all of it where it is noise. A linear predictor of row k,

    a(k) = sum_{i=1..n} c_i a(k-i) + sum_{i=0..n} b_i u(k-i) + c

tells them apart: of a step of u its answer in the first row is b_0, in the second b_0 (1 + c_1) + b_1. After the jump
both are near to the gain; before it the first is none. What a drive leaks into a reading is less than half the gain.

Reference: L. Ljung, System Identification, 1999, section 4.2 (ARX models).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record

ORDER = 4
"""Rows of the past; a resonance alone has two, the others take up what a noise and a further law do to a predictor."""
MOST_ROWS = 20_000
"""Rows that are looked at: more know it no better."""
LEAST_SIGNIFICANCE = 5.0
"""Standard errors of b_0 from which it is there."""
LEAST_SHARE = 0.5
"""Least part of the answer's second row that its first has, after a jump."""


class Answer(NamedTuple):
    """What a row of an acceleration has of a step of the drive."""

    first: float
    """In the row in which the drive steps: b_0."""
    second: float
    """In the row after it."""
    error: float
    """Standard error of `first`."""


def reads_after_jump(records: Iterable[tuple[FloatArray, FloatArray]]) -> bool:
    """Return whether rows of an acceleration already have the drive of their own row.

    Args:
        records: drive (n,) and acceleration (n,) of each record, read in the same way. The more one tells, the more it
            counts.
    """
    found = [answer for drive, read in records if (answer := answer_to_a_step(drive, read)) is not None]
    if not found:
        return False
    first, second, error = np.array(found).T
    weight = 1.0 / np.maximum(error, 1e-9 * np.abs(second) + 1e-300) ** 2
    mean, after = (float(np.sum(weight * one) / np.sum(weight)) for one in (first, second))
    return abs(mean) > LEAST_SIGNIFICANCE / math.sqrt(np.sum(weight)) and abs(mean) > LEAST_SHARE * abs(after)


def answer_to_a_step(drive: FloatArray, acceleration: FloatArray) -> Answer | None:
    """Return what rows have of a step; None where a record cannot tell."""
    u, a = drive[:MOST_ROWS], acceleration[:MOST_ROWS]
    rows, columns = len(a) - ORDER, 2 * ORDER + 2
    if (
        rows < 4 * columns
        or not (np.isfinite(a).all() and np.isfinite(u).all())
        or not min(np.ptp(u), np.ptp(a)) > 0.0
    ):
        return None
    past = [a[ORDER - i : len(a) - i] for i in range(1, ORDER + 1)]
    driven = [u[ORDER - i : len(u) - i] for i in range(ORDER + 1)]
    table = np.column_stack([*past, *driven, np.ones(rows)])
    sizes = np.sqrt(np.mean(table**2, axis=0))
    sizes[sizes == 0.0] = 1.0
    vectors, values, weights = np.linalg.svd(table / sizes, full_matrices=False)
    inverse = np.where(values > 1e-12 * values[0], 1.0 / np.maximum(values, 1e-300), 0.0)
    found = weights.T @ (inverse * (vectors.T @ a[ORDER:]))
    left = a[ORDER:] - (table / sizes) @ found
    variance = float(left @ left) / (rows - columns)
    error = math.sqrt(variance * float(np.sum((weights[:, ORDER] * inverse) ** 2)))
    coefficients = found / sizes
    first = float(coefficients[ORDER])
    second = first * (1.0 + float(coefficients[0])) + float(coefficients[ORDER + 1])
    return Answer(first, second, error / float(sizes[ORDER]))


def read_alike(records: Sequence[Record]) -> tuple[Record, ...]:
    """Return records that one instrument read, with what all of them together show of its readings."""
    after = is_read_after_jump(records)
    return tuple(replace(one, after_jump=after) for one in records)


def is_read_after_jump(records: Iterable[Record]) -> bool:
    """Return whether the accelerations of records are read just after the drive jumps at their rows."""
    return reads_after_jump(
        (one.signals["drive"], one.signals["acceleration"])
        for one in records
        if one.has("drive") and one.has("acceleration") and not one.is_sweep
    )
