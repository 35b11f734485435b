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

import numpy as np

from rtctl.border.arrays import FloatArray

ORDER = 4
"""Rows of the past; a resonance alone has two, the others take up what a noise and a further law do to a predictor."""
MOST_ROWS = 20_000
"""Rows that are looked at: more know it no better."""
LEAST_SIGNIFICANCE = 5.0
"""Standard errors of b_0 from which it is there."""
LEAST_SHARE = 0.5
"""Least part of the answer's second row that its first has, after a jump."""


def reads_after_jump(drive: FloatArray, acceleration: FloatArray) -> bool:
    """Return whether rows of `acceleration` (n,) already have the `drive` (n,) of their own row."""
    u, a = drive[:MOST_ROWS], acceleration[:MOST_ROWS]
    rows, spread = len(a) - ORDER, float(np.ptp(u))
    columns = 2 * ORDER + 2
    if rows < 4 * columns or not spread > 0.0 or not np.isfinite(a).all() or not np.isfinite(u).all():
        return False
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
    return abs(found[ORDER]) > LEAST_SIGNIFICANCE * error and abs(first) > LEAST_SHARE * abs(second)
