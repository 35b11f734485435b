"""States of a user's equations one sample later, for many points at once: Runge-Kutta steps of order 4, on their own.

The estimator integrates by itself: an error in the simulated device's integrator must not cancel in a loop's test.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def advance(  # noqa: PLR0913
    law: Any,
    points: FloatArray,
    u: FloatArray,
    p: FloatArray,
    low: FloatArray,
    high: FloatArray,
    step_s: float,
    steps: int,
) -> None:
    """Move points through held inputs, in place.

    Args:
        law: Rates of the model (`rtctl.border.equations.controlled.StateSpace.law`).
        points: States (points, n) [SI].
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters, 1) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        steps: Number of steps.
    """
    m, n = points.shape
    k1, k2, k3, k4, there = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for j in range(m):
        x = points[j]
        for _ in range(steps):
            law(x, u, 0.0, p, 0, k1)
            for i in range(n):
                there[i] = x[i] + 0.5 * step_s * k1[i]
            law(there, u, 0.0, p, 0, k2)
            for i in range(n):
                there[i] = x[i] + 0.5 * step_s * k2[i]
            law(there, u, 0.0, p, 0, k3)
            for i in range(n):
                there[i] = x[i] + step_s * k3[i]
            law(there, u, 0.0, p, 0, k4)
            for i in range(n):
                moved = x[i] + step_s / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
                x[i] = min(max(moved, low[i]), high[i])
