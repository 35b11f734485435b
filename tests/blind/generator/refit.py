"""What of the effect is left when the nominal model's own parameters are re-fitted: what a diagnosis can see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from .equation import P
from .plan import FloatArray, Input, LeftDeviceError, Plan, simulate

SAMPLES = 20_000  # over all records; this is a figure about the case, not a fit to be used
EVALUATIONS = 5  # Jacobians


def refitted_miss(nominal: Plan, inputs: list[Input], clean: list[FloatArray], slow: bool) -> float:
    """rms of the noise-free outputs minus the re-fitted nominal model's, displacement in L.

    `slow`: the effect needs whole records to show, so few whole records are taken rather than the begin of all.
    """
    chosen, cut = list(zip(inputs, clean, strict=True)), SAMPLES // len(inputs)
    if slow:
        chosen = sorted(chosen, key=lambda pair: -pair[0].drive.size)
        cut = chosen[0][0].drive.size
        chosen = chosen[: max(1, SAMPLES // cut)]
    free = [P.C, P.K, P.G] + ([P.K3] if nominal.parameters[P.K3] != 0.0 else [])

    def misses(changes: FloatArray) -> FloatArray:
        parameters = nominal.parameters.copy()
        parameters[free] *= np.exp(changes)
        trial = replace(nominal, parameters=parameters)
        parts = []
        for record, y in chosen:
            begin = float(y[0]) - nominal.rest  # formats.md: at rest at the first sample's displacement
            moved = replace(record, displaced=record.displaced or begin)
            try:
                parts.append(_from(trial, moved, nominal.rest, cut) - y[:cut])
            except LeftDeviceError:
                parts.append(np.full(min(cut, y.size), 1e3))
        return np.concatenate(parts)

    fit = least_squares(misses, np.zeros(len(free)), diff_step=1e-5, x_scale=0.05, max_nfev=EVALUATIONS)
    return float(np.sqrt(np.mean(fit.fun**2)))


def _from(plan: Plan, record: Input, rest: float, cut: int) -> FloatArray:
    """Simulation from `rest` + displaced, whatever the trial parameters' own equilibrium is."""
    _, start = simulate(plan, record, 2)
    return simulate(plan, record, cut, rest + record.displaced - start)[0]
