"""What of the effect is left when the identified model's time constant, gains and offsets are re-fitted."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from .plant import Input, Output, Plant, twin
from .sizing import pooled

OUTPUTS = ("resistance", "deflection")
EVALUATIONS = 10


def refitted_misses(identified: Plant, records: list[Input], clean: list[Output]) -> dict[str, float]:
    """rms left in each output, where the time constant lowers the sum of squares (each in its own variance)."""

    def misses(change: float) -> dict[str, float]:
        trial = identified.having(tau=identified.physics.tau * np.exp(change))
        outputs = [twin(trial, record) for record in records]
        left = {}
        for name in OUTPUTS:
            x, y = pooled(outputs, name), pooled(clean, name)
            basis = np.column_stack([x - x.mean(), np.ones(x.size)])
            fit, *_ = np.linalg.lstsq(basis, y, rcond=None)
            left[name] = float(np.sqrt(np.mean((y - basis @ fit) ** 2)))
        return left

    def cost(change: float) -> float:
        return sum((miss / pooled(clean, name).std()) ** 2 for name, miss in misses(change).items())

    best = minimize_scalar(
        cost, bounds=(-0.3, 1.2), method="bounded", options={"maxiter": EVALUATIONS, "xatol": 1e-3}
    )
    return misses(float(best.x))
