"""Equations (8) to (11), the inverse of a Prandtl-Ishlinskii model, tried on the weights of the paper's table I.

y = sum_j p_j F_rj[u],   u = p^_0 y + sum_k p^_k F_r^k[y],   r^_j = p_0 r_j + sum_{0<k<j} p_k (r_j - r_k)
p^_k = -+ p_k / (P_k P_(k-1)),   P_k = p_0 + ... + p_k
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.play import run_play


def damped(cycles: int = 8, samples: int = 200) -> FloatArray:
    """Return a damped oscillation within +-1 from 0: the input of the plays after the envelopes."""
    turns = [0.0]
    for size in np.linspace(1.0, 0.0, cycles, endpoint=False):
        turns += [float(size), -float(size)]
    return np.concatenate([np.linspace(a, b, samples) for a, b in zip(turns, turns[1:], strict=False)])


def inverse_error(weights: Sequence[float], sign: float) -> float:
    """Return the largest relative |u - inverse(model(u))|; `sign` of p^_k: +1 as printed, -1 as it must be."""
    p, u = np.asarray(weights, np.float64), damped()
    r = np.arange(len(p)) / len(p)
    y = sum(
        (weight * run_play(0.0, u, radius) for weight, radius in zip(p, r, strict=True)), np.zeros_like(u)
    )
    total = np.cumsum(p)
    r_hat = [float(np.sum(p[:j] * (r[j] - r[:j]))) for j in range(len(p))]
    p_hat = [1.0 / p[0], *(sign * p[k] / (total[k] * total[k - 1]) for k in range(1, len(p)))]
    back = sum(
        (weight * run_play(0.0, y, radius) for weight, radius in zip(p_hat, r_hat, strict=True)),
        np.zeros_like(u),
    )
    return float(np.abs(back - u).max() / np.ptp(u))
