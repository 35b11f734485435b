"""Time of one self-sensing calculation: compiled in a compiled loop, and as a step called from Python.

Rounds are interleaved and the least of them counts, so that other load on the machine affects all alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.estimators import ESTIMATORS as BUILDERS
from rtctl.estimators.composite import SURROGATE_MARGIN, composite_step
from rtctl.estimators.gap_free import gap_free_composite_step
from rtctl.hysteresis.egpi import EgpiParams, egpi_run
from rtctl.hysteresis.gap_free import GapFreeParams
from rtctl.hysteresis.gpi_inverse import GpiInverse, GpiInverseParams
from rtctl.hysteresis.preisach.model import preisach_run
from rtctl.models.vo2 import Vo2Model

ROUNDS = 9
CALLED_SAMPLES = 1000
TIMED = ("composite", "gap_free", "preisach", "egpi")


class CalculationTime(NamedTuple):
    """Calculation time of one sample."""

    compiled_ns: float
    called_us: float
    """Time [us] as `Estimator.step`, from Python."""


@kernel
def composite_run(
    state: FloatArray,
    plays: FloatArray,
    ohm: FloatArray,
    low: float,
    high: float,
    inverse: GpiInverseParams,
    egpi: EgpiParams,
) -> FloatArray:
    """Return the deflection [um] for each resistance."""
    deflection = np.empty_like(ohm)
    for k in range(ohm.size):
        deflection[k] = composite_step(state, plays, ohm[k], low, high, inverse, egpi)[0]
    return deflection


@kernel
def gap_free_composite_run(
    state: FloatArray,
    plays: FloatArray,
    ohm: FloatArray,
    low: float,
    high: float,
    inverse: GapFreeParams,
    egpi: EgpiParams,
) -> FloatArray:
    """Return the deflection [um] for each resistance."""
    deflection = np.empty_like(ohm)
    for k in range(ohm.size):
        deflection[k] = gap_free_composite_step(state, plays, ohm[k], low, high, inverse, egpi)[0]
    return deflection


def calculation_times(model: Vo2Model, resistance_ohm: FloatArray) -> dict[str, CalculationTime]:
    """Return the times of `TIMED`, on the resistances of a recording (n,)."""
    compiled = {name: 1e9 / len(resistance_ohm) for name in TIMED}
    calls = _compiled_calls(model, resistance_ohm)
    ohm = resistance_ohm[:CALLED_SAMPLES].tolist()
    python = {name: _called(model, name, ohm) for name in TIMED}
    least = {name: _least(calls[name], python[name]) for name in TIMED}
    return {
        name: CalculationTime(compiled[name] * least[name][0], 1e6 / len(ohm) * least[name][1])
        for name in TIMED
    }


def _least(*calls: Callable[[], Any]) -> list[float]:
    """Return the seconds of each call, the least of `ROUNDS` after one that compiles."""
    for call in calls:
        call()
    rounds = []
    for _ in range(ROUNDS):
        seconds = []
        for call in calls:
            start = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - start)
        rounds.append(seconds)
    return [min(column) for column in zip(*rounds, strict=True)]


def _compiled_calls(model: Vo2Model, ohm: FloatArray) -> dict[str, Callable[[], Any]]:
    v0, margin = model.current.low, SURROGATE_MARGIN * model.current.width
    ends = model.current.low - margin, model.current.high + margin
    inverse, free, u = GpiInverse.of(model.resistance_gpi), model.resistance_gap_free, -np.log(ohm)
    first, second = model.composite_egpi, model.gap_free_egpi
    return {
        "composite": lambda: composite_run(
            inverse.initial_state(v0), first.initial_state(v0), ohm, *ends, inverse.params, first.params
        ),
        "gap_free": lambda: gap_free_composite_run(
            free.initial_state(v0), second.initial_state(v0), ohm, *ends, free.params, second.params
        ),
        "preisach": lambda: preisach_run(
            model.direct_preisach.initial_state(u[0]), u, model.direct_preisach.params
        ),
        "egpi": lambda: egpi_run(model.direct_egpi.initial_state(u[0]), u, model.direct_egpi.params),
    }


def _called(model: Vo2Model, kind: str, ohm: Sequence[float]) -> Callable[[], None]:
    estimator = BUILDERS[kind](model)
    estimator.start((model.current.low,), (ohm[0],))

    def call() -> None:
        for reading in ohm:
            estimator.step((model.current.low,), (reading,), 1e-3)

    return call
