"""The temperature at which a record begins, where its first readings show that the film was not at rest.

A bench that switches the current on with the first row records a film that is still cold; one that cuts a record from
a longer one records a film on the way. Only the first readings know: the surrogate at the first row is the one that
follows them best, over as many rows as the film needs to forget it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S, SURROGATE

TIME_CONSTANTS = 3.0
"""Time constants at the start of a record that tell where it began."""
LEAST_ROWS = 3
CANDIDATES = 33
"""Initial surrogates that are tried, before the best one is refined."""
CERTAIN_RATIO = 3.0
"""Ratio of the first rows' RMS error from rest to that from elsewhere, above which the film was not at rest."""
USUAL_RATIO = 3.0
"""Ratio of the first rows' RMS error from rest to the record's median error, below which nothing is amiss."""


def find_initial_temperature(simulation: Simulation, record: FitRecord) -> FitRecord:
    """Return `record` with the initial surrogate [mA] that its first readings show; unchanged where it was at rest.

    Args:
        simulation: The model in the outputs of `record`.
        record: Record whose start may be given already; then it stays.
    """
    name = SURROGATE[0]
    if name in record.stimulus.initial:
        return record
    values = np.array([one.value for one in simulation.parameters])
    tau_s = next(
        (one.value for one in simulation.parameters if one.name == "time_constant"), NOMINAL_TIME_CONSTANT_S
    )
    rows = max(LEAST_ROWS, math.ceil(TIME_CONSTANTS * tau_s / record.period_s)) + 1
    if record.samples < 2 * rows:
        return record
    sizes = {output: float(np.std(readings)) or 1.0 for output, readings in record.measured.items()}

    def misses(one: FitRecord) -> FloatArray:
        run = simulation.predict(one.stimulus, values)
        off = [(run.outputs[output][0] - one.measured[output]) / size for output, size in sizes.items()]
        missed: FloatArray = np.nan_to_num(np.sqrt(np.mean(np.square(off), axis=0)), nan=np.inf)
        return missed

    def begun_at(surrogate: float) -> FitRecord:
        return replace(
            head, stimulus=replace(head.stimulus, initial={**head.stimulus.initial, name: surrogate})
        )

    def cost(surrogate: float) -> float:
        return float(np.sum(misses(begun_at(surrogate)) ** 2))

    whole, head = misses(record), record.truncate(rows)
    rest = float(np.sum(whole[:rows] ** 2))
    if not rest > rows * (USUAL_RATIO * float(np.median(whole))) ** 2:
        return record
    grid = np.linspace(0.0, 1.1 * float(record.stimulus.inputs["current"].max()), CANDIDATES)
    best = int(np.argmin([cost(float(one)) for one in grid]))
    bounds = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, CANDIDATES - 1)])
    found = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3 * grid[1]}).x)
    if not rest > CERTAIN_RATIO**2 * cost(found):
        return record
    stimulus = record.stimulus
    return replace(record, stimulus=replace(stimulus, initial={**stimulus.initial, name: found}))
