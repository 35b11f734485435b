"""A hypothesis: the nominal model and a set of mechanisms, all of their parameters fitted to the same records."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.levenberg_marquardt import Unknowns, minimise
from rtctl.identification.segments import Segment, SegmentCost
from rtctl.identification.sensitivity import Linearised, Sensitivity

FloatArray = NDArray[np.float64]
MOST_ITERATIONS = 40
MOST_SCALES = 5.0
"""A mechanism that acts so many times as much as all the rest is none that is to be found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Data:
    """The records that a diagnosis fits, how large their motion is, and on what it runs."""

    records: tuple[FitRecord, ...]
    scales: Scales
    executor: Executor | None = None
    steps_per_period: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """A fitted one: `cost` is half the sum of squares over `sigma`."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    """At the fitted values."""
    starts: FloatArray
    """(records, states): fitted initial states in units."""
    cost: float
    sensitivity: Sensitivity
    shared: FloatArray
    """Fitted parameters, scaled."""

    @property
    def values(self) -> FloatArray:
        """All parameters (parameters,) in units."""
        return self.sensitivity.values(self.shared)

    def linearise(self, data: Data) -> list[Linearised]:
        """Residual and slopes of each record; raises ArithmeticError where the optimum is on the edge of divergence."""

        def one(index: int) -> Linearised | None:
            return self.sensitivity.linearise(
                data.records[index], self.shared, self.starts[index], data.steps_per_period
            )

        indices = range(len(data.records))
        made = list(data.executor.map(one, indices)) if data.executor else [one(k) for k in indices]
        whole = [found for found in made if found is not None]
        if len(whole) < len(made):
            raise ArithmeticError("the fitted model diverges in the neighbourhood of its optimum")
        return whole


def fitted(
    data: Data,
    simulation: Simulation,
    mechanisms: Sequence[str],
    starts: FloatArray | None = None,
    iterations: int = MOST_ITERATIONS,
) -> Hypothesis | None:
    """From the values of `simulation`; None: it diverges there. `starts` (records, states) in units."""
    sensitivity = Sensitivity.of(simulation, data.records, scales=data.scales)
    sigma = np.array([_rms(data.records, name) for name in sensitivity.outputs])
    if starts is None:
        starts = np.array(
            [[r.stimulus.initial.get(name, 0.0) for name in simulation.state] for r in data.records]
        )
    cost = SegmentCost(
        sensitivity=sensitivity,
        segments=[Segment(record, start, False) for record, start in zip(data.records, starts, strict=True)],
        sigma=sigma,
        executor=data.executor,
        steps_per_period=data.steps_per_period,
    )
    begin = cost.start(sensitivity.own_values[sensitivity.free] / sensitivity.scale)
    low, high = _bounds(sensitivity, data.scales)
    found = minimise(cost.equations, begin, low, high, iterations=iterations, tolerance=1e-7)
    if found is None:
        return None
    return _hypothesis(cost, tuple(mechanisms), found.unknowns, found.equations.cost)


def _bounds(sensitivity: Sensitivity, scales: Scales) -> tuple[FloatArray, FloatArray]:
    """Of the scaled unknowns; shapes stay where they are a shape: a yield displacement of 0 is dry friction."""
    low, high = sensitivity.bounds
    for k, index in enumerate(sensitivity.free):
        declared = sensitivity.simulation.parameters[index].declared
        parameter = sensitivity.simulation.parameters[index]
        if parameter.mechanism and not declared.is_shape:
            low[k], high[k] = max(low[k], -MOST_SCALES), min(high[k], MOST_SCALES)
        if declared.is_shape and declared.default is None:
            size = abs(float(declared.scale(scales))) / sensitivity.scale[k]
            low[k] = max(low[k], declared.shape_range[0] * size)
            high[k] = min(high[k], declared.shape_range[1] * size)
    return low, high


def _hypothesis(
    cost: SegmentCost, mechanisms: tuple[str, ...], unknowns: Unknowns, value: float
) -> Hypothesis:
    values = cost.sensitivity.values(unknowns.shared)
    return Hypothesis(
        mechanisms=mechanisms,
        simulation=cost.sensitivity.simulation.with_values(values),
        starts=np.array([cost.state(k, unknowns) for k in range(len(cost.segments))]),
        cost=value,
        sensitivity=cost.sensitivity,
        shared=unknowns.shared,
    )


def _rms(records: Sequence[FitRecord], output: str) -> float:
    squares = sum(float(r.measured[output][r.first :] @ r.measured[output][r.first :]) for r in records)
    return float(np.sqrt(squares / sum(r.samples - r.first for r in records))) or 1.0
