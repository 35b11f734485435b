"""A hypothesis: the nominal model and a set of mechanisms, all of their parameters fitted to the same records."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.budget import Budget
from rtctl.diagnosis.problem.subject import Subject
from rtctl.diagnosis.residual.quantization import step_of
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, minimise, predict_gain
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Linearisation, Sensitivity

LEAST_DETERMINED = 1e-7
"""Squared share of a parameter's slopes beyond all others': below it, it says what they say."""
MOST_ITERATIONS = 40
KEPT = 2
"""Points of a fit whose derivatives are kept: where it is, and where it went last."""
MOST_SCALES = 5.0
"""A mechanism that acts so many times as much as all the rest is none that is to be found."""
FAR_OFF = 100.0
"""Times what matters as much as all the rest: beyond, no nominal value is looked for, unless the fit begins there."""
FURTHER = 2.0
"""Times where it begins: a beam far below its resonance has a stiffness of many scales."""


def _never() -> bool:
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """The records that a diagnosis fits, how large their motion is, and on what it runs."""

    subject: Subject
    records: tuple[FitRecord, ...]
    scales: Scales
    executor: Executor | None = None
    steps_per_period: float | None = None
    allowed: Mapping[str, float] = field(default_factory=dict)
    """Of an output, mean square of a misfit that is no gap, since the nominal model never claimed more."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    enough: Callable[[], bool] = _never
    """Asked between the steps of a fit, which then ends where it is."""

    def until(self, budget: Budget) -> Problem:
        """The same, on which a fit ends once `budget` is spent."""
        return replace(self, enough=lambda: budget.spent)

    @property
    def samples(self) -> int:
        """Of all records."""
        return sum(record.samples for record in self.records)

    @property
    def glance(self) -> Problem:
        """The beginnings of its records, so many samples as a first look at each hypothesis takes."""
        most = self.subject.glance_samples
        if most is None or self.samples <= most:
            return self
        each = max(1, most // len(self.records))
        return replace(self, records=tuple(r.truncate(max(each, r.first + each // 2)) for r in self.records))

    def step(self, output: str) -> float:
        """Of the converter that the output was read with; 0 where none can be seen."""
        return _step(self.records, output)

    def size(self, output: str) -> float:
        """RMS of a measured output over all scored samples, about its mean where the subject has it so; 1 if zero."""
        values = np.concatenate([record.measured[output][record.first :] for record in self.records])
        return float(values.std() if self.subject.about_mean else np.sqrt(np.mean(values**2))) or 1.0


@lru_cache(maxsize=8)
def _step(records: tuple[FitRecord, ...], output: str) -> float:
    return step_of([record.measured[output] for record in records])


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """A fitted one: `cost` is half the sum of squares over `sigma`."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    """At the fitted values."""
    starts: FloatArray
    """(records, states and own parameters): fitted, in units."""
    cost: float
    sensitivity: Sensitivity
    shared: FloatArray
    """Fitted parameters, scaled."""
    still: frozenset[str] = frozenset()
    """Names of parameters that were not fitted: at their defaults, or without effect on these records."""
    promised: float = np.inf
    """The cost after one more step, were the model linear: far below `cost` where the fit was not done."""

    @property
    def values(self) -> FloatArray:
        """All parameters (parameters,) in units; of those that each record has for itself, the first one's."""
        return self.values_of(0)

    def values_of(self, record: int) -> FloatArray:
        """All parameters (parameters,) of one record."""
        values = self.sensitivity.values(self.shared)
        values[self.sensitivity.record_parameters] = self.starts[record, self.states :]
        return values

    @property
    def states(self) -> int:
        """Length of an initial state, which a record's own parameters follow in `starts`."""
        return len(self.simulation.state)

    def start(self, record: int) -> FloatArray:
        """Fitted initial state (states,) of one record."""
        return self.starts[record, : self.states]

    def linearise(self, problem: Problem) -> list[Linearisation]:
        """Residual and slopes of each record; raises ArithmeticError where the optimum is on the edge of divergence."""

        def one(index: int) -> Linearisation | None:
            return self.sensitivity.linearise(
                problem.records[index], self.shared, self.starts[index], problem.steps_per_period
            )

        indices = range(len(problem.records))
        made = list(problem.executor.map(one, indices)) if problem.executor else [one(k) for k in indices]
        whole = [found for found in made if found is not None]
        if len(whole) < len(made):
            raise ArithmeticError("the fitted model diverges in the neighbourhood of its optimum")
        return whole


def fit_hypothesis(
    problem: Problem,
    simulation: Simulation,
    mechanisms: Sequence[str],
    starts: FloatArray | None = None,
    iterations: int = MOST_ITERATIONS,
    still: frozenset[str] = frozenset(),
) -> Hypothesis | None:
    """From the values of `simulation`; None: it diverges there. `starts` (records, states) in units."""
    sensitivity = sensitivity_of(problem, simulation, still)
    sigma = np.array([problem.size(name) for name in sensitivity.outputs])
    values = np.array([one.value for one in simulation.parameters])
    given = [simulation.starting(record.stimulus, values) for record in problem.records]
    if starts is None:
        starts = np.array([[*start, *values[sensitivity.record_parameters]] for start in given])
    cost = SegmentCost(
        sensitivity=sensitivity,
        segments=[
            Segment(record, start, False, near if record.first else None)
            for record, start, near in zip(problem.records, starts, given, strict=True)
        ],
        sigma=sigma,
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
        cache_size=KEPT,
    )
    begin = cost.start(sensitivity.current_values[sensitivity.free] / sensitivity.scale)
    low, high = bounds(sensitivity, problem.scales)
    found = minimise(
        cost.equations,
        begin,
        low,
        high,
        iterations=iterations,
        tolerance=1e-7,
        should_stop=problem.enough,
        second_derivative=cost.compute_second_derivative,
    )
    if found is None:
        return None
    return _hypothesis(cost, tuple(mechanisms), found, predict_gain(found, low, high), still)


def sensitivity_of(problem: Problem, simulation: Simulation, still: frozenset[str]) -> Sensitivity:
    """Of all parameters but fixed ones and those in `still`; a record's own ones go with its start."""
    free = [k for k, one in enumerate(simulation.parameters) if not one.fixed and one.name not in still]
    apart = [k for k in free if simulation.parameters[k].declared.per_record]
    return Sensitivity.of(simulation, problem.records, free, scales=problem.scales, record_parameters=apart)


def polish(problem: Problem, hypothesis: Hypothesis, iterations: int = MOST_ITERATIONS) -> Hypothesis | None:
    """To the end, with every shape free that these records can determine beside the others."""
    still = set(hypothesis.still)
    redundant = {one.name for one in hypothesis.simulation.parameters if one.declared.redundant}
    for name in _defaulted(hypothesis.simulation, hypothesis.mechanisms)[::-1]:
        if name in still - redundant and _determined(problem, hypothesis, still - {name}, name):
            still.discard(name)
    return fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, hypothesis.starts, iterations, frozenset(still)
    )


def defaulted(simulation: Simulation) -> frozenset[str]:
    """Names of shapes of mechanisms that have a default: they stay there until the rest is known."""
    return frozenset(_defaulted(simulation, tuple(mechanism.id for mechanism in simulation.mechanisms)))


def _defaulted(simulation: Simulation, mechanisms: Sequence[str]) -> list[str]:
    return [
        one.name
        for one in simulation.parameters
        if one.mechanism in mechanisms and one.declared.is_shape and one.declared.default is not None
    ]


def _determined(problem: Problem, hypothesis: Hypothesis, still: set[str], name: str) -> bool:
    """Whether the records tell it from all other free ones: of Bouc-Wen's four numbers one only names the others."""
    again = fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, hypothesis.starts, 0, frozenset(still)
    )
    if again is None:
        return False
    gram = np.zeros((len(again.shared), len(again.shared)))
    try:
        lines = again.linearise(problem)
    except ArithmeticError:
        return False
    for line in lines:
        flat = line.shared.reshape(len(line.shared), -1)
        gram += flat @ flat.T
    sensitivity = again.sensitivity
    names = [sensitivity.simulation.parameters[k].name for k in sensitivity.free]
    own, others = names.index(name), [k for k, other in enumerate(names) if other != name]
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    normal = gram / size[:, None] / size
    border = normal[own, others]
    alike = border @ np.linalg.pinv(normal[np.ix_(others, others)], rcond=1e-12, hermitian=True) @ border
    return bool(gram[own, own] > 0.0 and 1.0 - alike > LEAST_DETERMINED)


def bounds(sensitivity: Sensitivity, scales: Scales) -> tuple[FloatArray, FloatArray]:
    """Of the scaled unknowns; shapes stay where they are a shape: a yield displacement of 0 is dry friction.

    Nominal values may move far, but not to where a motion would need steps without number.
    """
    low, high = sensitivity.bounds
    start = sensitivity.current_values[sensitivity.free] / sensitivity.scale
    for k, index in enumerate(sensitivity.free):
        declared = sensitivity.simulation.parameters[index].declared
        parameter = sensitivity.simulation.parameters[index]
        if parameter.mechanism and not declared.is_shape:
            most = MOST_SCALES * declared.reach
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if not parameter.mechanism:
            most = max(FAR_OFF, FURTHER * abs(float(start[k])))
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if declared.is_shape:
            open_ended = not declared.default or declared.searched
            scale = declared.scale(scales) if open_ended else declared.default
            size = abs(float(scale)) / sensitivity.scale[k]
            signed = declared.low < 0.0
            low[k] = max(low[k], (-declared.shape_range[1] if signed else declared.shape_range[0]) * size)
            high[k] = min(high[k], declared.shape_range[1] * size)
    return low, high


def _hypothesis(
    cost: SegmentCost,
    mechanisms: tuple[str, ...],
    found: Minimum,
    gain: float,
    still: frozenset[str],
) -> Hypothesis:
    unknowns = found.unknowns
    values = cost.sensitivity.values(unknowns.shared)
    starts = np.array([cost.state(k, unknowns) for k in range(len(cost.segments))])
    values[cost.sensitivity.record_parameters] = starts[0, len(cost.sensitivity.simulation.state) :]
    return Hypothesis(
        mechanisms=mechanisms,
        simulation=cost.sensitivity.simulation.with_values(values),
        starts=starts,
        cost=found.equations.cost,
        sensitivity=cost.sensitivity,
        shared=unknowns.shared,
        still=still,
        promised=found.equations.cost - gain,
    )
