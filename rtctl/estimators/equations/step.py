"""One Runge-Kutta step of order 4 of a user's equations under held inputs."""

from __future__ import annotations

from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


# 10 parameters because a compiled kernel takes its arrays one by one
@kernel
def step(  # noqa: PLR0913
    law: Any, x: FloatArray, u: FloatArray, p: FloatArray, low: FloatArray, high: FloatArray, step_s: float,
    k: FloatArray, there: FloatArray, moved: FloatArray,
) -> None:  # fmt: skip
    """Fill `moved` (n,) with the states `x` (n,) after a step, within their limits; `moved` may be `x`.

    Args:
        law: Rates of the model.
        x: States [SI].
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters, 1) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        k: Room for rates (4, n).
        there: Room for states (n,).
        moved: See above.
    """
    n = x.shape[0]
    law(x, u, 0.0, p, 0, k[0])
    for stage in range(1, 4):
        share = step_s if stage == 3 else 0.5 * step_s
        for i in range(n):
            there[i] = x[i] + share * k[stage - 1, i]
        law(there, u, 0.0, p, 0, k[stage])
    for i in range(n):
        end = x[i] + step_s / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])
        moved[i] = min(max(end, low[i]), high[i])
