"""Time constant of the heating from transients, by output error.

    ds/dt = (i^2 - s) / tau,   v = sqrt(s)

s is the surrogate of the temperature rise as a current's square [mA^2]: at rest s = i^2, so the hysteresis models
identified on staircases apply to v as they are, and only tau is left to find (paper, equations 1 and 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rtctl.kernels import kernel
from rtctl.measured.dataset import Record

FloatArray = NDArray[np.float64]


class ReadOut(Protocol):
    """A static hysteresis model of one output against v [mA]."""

    def simulate(self, v: FloatArray) -> FloatArray:
        """Output for each v, from the state that a full cooling leaves."""
        ...


class TimeConstant(NamedTuple):
    """tau [s] with its standard error, and how many moving samples decided it."""

    value_s: float
    standard_error_s: float
    samples: int


@kernel
def heat(current_mA: FloatArray, period_s: float, time_constant_s: float) -> FloatArray:
    """Surrogate v (n,) [mA] at the sample instants, before each sample's current takes effect.

    The current is held between samples; the first sample is at rest.
    """
    decay = math.exp(-period_s / time_constant_s)
    v = np.empty(len(current_mA))
    s = current_mA[0] * current_mA[0] if len(current_mA) else 0.0
    for k in range(len(current_mA)):
        v[k] = math.sqrt(s)
        power = current_mA[k] * current_mA[k]
        s = power + (s - power) * decay
    return v


def from_full_cooling(v: FloatArray) -> FloatArray:
    """v with one sample far below in front: any hysteresis model forgets what came before."""
    return np.concatenate((np.zeros(1), v))


def fit_time_constant(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float
) -> TimeConstant | None:
    """tau from the samples that move; None where every sample is at rest (sampled too slowly to see it).

    `resistance` gives -ln R. Residuals are weighted by what each read-out leaves at rest.
    """
    usable = [record for record in records if record.period_s < 2.0 * nominal_s]
    moving = sum(int(_moving(record).sum()) for record in usable)
    if moving < 20:
        return None

    def cost(ln_tau: float) -> float:
        return sum(_misfit(record, resistance, deflection, math.exp(ln_tau)) for record in usable)

    centre = math.log(nominal_s)
    found = minimize_scalar(
        cost, bounds=(centre - 2.3, centre + 2.3), method="bounded", options={"xatol": 1e-4}
    )
    best, step = float(found.x), 0.02
    curvature = (cost(best + step) - 2.0 * cost(best) + cost(best - step)) / step**2
    variance = 2.0 * cost(best) / max(moving - 1, 1) / curvature if curvature > 0.0 else math.inf
    tau = math.exp(best)
    return TimeConstant(tau, tau * math.sqrt(variance), moving)


def _moving(record: Record) -> NDArray[np.bool_]:
    """Samples within ten samples after a change of current."""
    current = record.signals["current"]
    changed = np.flatnonzero(np.diff(current) != 0.0) + 1
    mask = np.zeros(len(current) + 10, dtype=bool)
    for offset in range(1, 10):
        mask[changed + offset] = True
    mask = mask[: len(current)]
    mask[: record.ignore_first] = False
    return mask


def _misfit(record: Record, resistance: ReadOut, deflection: ReadOut | None, tau_s: float) -> float:
    v = from_full_cooling(heat(record.signals["current"], record.period_s, tau_s))
    moving = _moving(record)
    error = (resistance.simulate(v)[1:] + np.log(record.signals["resistance"]))[moving]
    total = float(error @ error) / max(float(np.ptp(np.log(record.signals["resistance"]))), 1e-9) ** 2
    if deflection is not None and record.has("deflection"):
        error = (deflection.simulate(v)[1:] - record.signals["deflection"])[moving]
        total += float(error @ error) / max(float(np.ptp(record.signals["deflection"])), 1e-9) ** 2
    return total
