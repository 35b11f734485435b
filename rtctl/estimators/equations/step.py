"""Runge-Kutta steps of order 4 of a user's equations under held inputs.

An estimator integrates by itself: an error in the simulated device's integrator must not cancel in a loop's test.
"""

from __future__ import annotations

from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel

LEAST_LEFT = 1e-9
"""Share of a step that is not worth one of its own."""


@kernel
def whole_steps(elapsed_s: float, step_s: float) -> int:
    """Return into how many steps of at most `step_s` [s] a time [s] is divided, at least 1."""
    share = elapsed_s / step_s - LEAST_LEFT
    steps = int(share)
    return max(1, steps if steps >= share else steps + 1)


# 10 parameters because a compiled kernel takes its arrays one by one
@kernel
def step(  # noqa: PLR0913
    rates: Any, x: FloatArray, u: FloatArray, p: FloatArray, low: FloatArray, high: FloatArray, step_s: float,
    k: FloatArray, there: FloatArray, moved: FloatArray,
) -> None:  # fmt: skip
    """Fill `moved` (n,) with the states `x` (n,) after a step, within their limits; `moved` may be `x`.

    Args:
        rates: Rates of the model.
        x: States [SI].
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters,) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        k: Room for rates (4 * n,), those of one stage after those of another.
        there: Room for states (n,).
        moved: See above.
    """
    n = x.size
    rates(x, u, p, k[0:n])
    for stage in range(1, 4):
        share = step_s if stage == 3 else 0.5 * step_s
        for i in range(n):
            there[i] = x[i] + share * k[(stage - 1) * n + i]
        rates(there, u, p, k[stage * n : (stage + 1) * n])
    for i in range(n):
        end = x[i] + step_s / 6.0 * (k[i] + 2.0 * (k[n + i] + k[2 * n + i]) + k[3 * n + i])
        moved[i] = min(max(end, low[i]), high[i])
