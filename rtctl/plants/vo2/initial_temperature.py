"""The temperature at which a record begins, where its first readings show that the film was not at rest.

A bench that switches the current on with the first row records a film that is still cold; one that cuts a record from
a longer one records a film on the way. Only the first readings know: the surrogate at the first row is the one that
follows them best, over as many rows as the film needs to forget it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S, SURROGATE, Vo2Model
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE, LogReading
from rtctl.simulations.vo2.simulation import Vo2Simulation

TIME_CONSTANTS = 3.0
"""Time constants at the start of a record that tell where it began."""
FORGOTTEN_AFTER = 6.0
"""Time constants after which a start below the identified loops is forgotten (0.25 %)."""
COLDER_ERRORS, COLDER_LEAST = 10.0, 0.02
"""Errors of the identified ln R, and the least difference, by which a first reading of a colder film is higher."""
LEAST_ROWS = 3
CANDIDATES = 33
"""Initial surrogates that are tried, before the best one is refined."""
CERTAIN_RATIO = 3.0
"""Ratio of the first rows' RMS error from rest to that from elsewhere, above which the film was not at rest."""
USUAL_RATIO = 3.0
"""Ratio of the first rows' RMS error from rest to the record's median error, below which nothing is amiss."""


def find_initial_temperature(simulation: Simulation, record: FitRecord) -> FitRecord:
    """Return `record` with the initial surrogate [mA] that its first readings show; unchanged where it was at rest.

    Where that is colder than the loops were identified, its first rows, until it is forgotten, are not scored.

    Args:
        simulation: The model in the outputs of `record`.
        record: Record whose start may be given already; then it stays.
    """
    values = np.array([one.value for one in simulation.parameters])
    tau_s = next(
        (one.value for one in simulation.parameters if one.name == "time_constant"), NOMINAL_TIME_CONSTANT_S
    )
    rows = max(LEAST_ROWS, math.ceil(TIME_CONSTANTS * tau_s / record.period_s)) + 1
    if SURROGATE[0] in record.stimulus.initial or record.samples < 2 * rows:
        return record
    sizes = {output: float(np.std(readings)) or 1.0 for output, readings in record.measured.items()}

    def squares(one: FitRecord) -> FloatArray:
        """Return the squared errors (n,) of a run, the mean of all outputs, each over its size."""
        run = simulation.predict(one.stimulus, values)
        errors = [(run.outputs[output][0] - one.measured[output]) / size for output, size in sizes.items()]
        found: FloatArray = np.nan_to_num(np.mean(np.square(errors), axis=0), nan=np.inf)
        return found

    whole = squares(record)
    rest = float(whole[:rows].sum())
    if not rest > rows * USUAL_RATIO**2 * float(np.median(whole)):
        return record
    model = _model_of(simulation)
    if model is not None and _reads_colder(record, model):
        found_mA = 0.0  # any that is colder than the loops know: it is not scored
    else:
        head = record.truncate(rows)
        found_mA, left = _search_surrogate(lambda v: float(squares(_begun_at(head, v)).sum()), record)
        if not rest > CERTAIN_RATIO**2 * left:
            return record
    is_below = model is not None and found_mA < model.current.low
    skipped = math.ceil(FORGOTTEN_AFTER * tau_s / record.period_s) if is_below else 0
    return replace(_begun_at(record, found_mA), first=max(record.first, skipped))


def _begun_at(record: FitRecord, surrogate_mA: float) -> FitRecord:
    initial = {**record.stimulus.initial, SURROGATE[0]: surrogate_mA}
    return replace(record, stimulus=replace(record.stimulus, initial=initial))


def _search_surrogate(cost: Callable[[float], float], record: FitRecord) -> tuple[float, float]:
    """Return the initial surrogate [mA] of the least cost, and that cost."""
    grid = np.linspace(0.0, 1.1 * float(record.stimulus.inputs["current"].max()), CANDIDATES)
    best = int(np.argmin([cost(float(one)) for one in grid]))
    bounds = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, CANDIDATES - 1)])
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3 * grid[1]})
    return float(found.x), float(found.fun)


def _model_of(simulation: Simulation) -> Vo2Model | None:
    """Return the identified model of a simulation."""
    plain = simulation.plain if isinstance(simulation, LogReading) else simulation
    return plain.model if isinstance(plain, Vo2Simulation) else None


def _reads_colder(record: FitRecord, model: Vo2Model) -> bool:
    """Return whether the first resistance is higher than any of the identification, beyond its error."""
    readings = record.measured.get(LOG_RESISTANCE)
    if readings is None:
        return False
    beyond = float(readings[0]) - math.log(model.resistance.high)
    return beyond > max(COLDER_ERRORS * model.reading_error, COLDER_LEAST)
