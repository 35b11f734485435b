"""Play operators: a memory w clamped between two edges, `w <- min(max(w, lower), upper)` (eqs. 3-4).

Classical play of radius r: lower = v - r, upper = v + r. Generalised play: lower = gamma_R(v) - r, upper =
gamma_L(v) + r. The direction test of eq. 4 is not needed where lower <= upper: on a rising input only the
lower edge can reach w, on a falling one only the upper. State order: w[j] of play j.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


@kernel
def play(w: float, lower: float, upper: float) -> float:
    """Return the memory after one step; `upper` wins where the edges cross, NaN edges hold w."""
    if w < lower:
        w = lower
    if w > upper:
        w = upper
    return w


@kernel
def classical_plays(w: FloatArray, u: float, r: FloatArray) -> None:
    """Advance classical plays of radii r (n,) to the input u, in place: memories w (n,), all in one unit."""
    for j in range(w.size):
        w[j] = play(w[j], u - r[j], u + r[j])


@kernel
def run_play(w: float, u: FloatArray, r: float) -> FloatArray:
    """Return outputs (samples,) of one classical play of radius r from the memory w over the inputs u (samples,)."""
    out = np.empty_like(u)
    for k in range(u.size):
        w = play(w, u[k] - r, u[k] + r)
        out[k] = w
    return out
