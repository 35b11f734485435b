"""A start for fits of whole records: the parameters that fit short stretches, each from a state of its own.

A lightly damped oscillator whose frequency is off by more than a period in Q has many minima over a whole record, and
a bistable one as many as turns; over a few periods there is one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.hypothesis import Data, Hypothesis, bounds, fitted, sensitivity_of
from rtctl.identification.levenberg_marquardt import minimise
from rtctl.identification.multiple_shooting import cut
from rtctl.identification.segments import Segment, SegmentCost
from rtctl.identification.sensitivity import Sensitivity
from rtctl.identification.weak_form import half_width

FloatArray = NDArray[np.float64]
PERIODS = (4.0, 16.0, 64.0)
"""Lengths of the stretches, one after the other."""
ITERATIONS = 8
JUDGED_PERIODS = 1.0
MOST_STRETCHES = 160
"""Of all records together, evenly spread: each costs a simulation with a state of its own."""
FAR = 0.3
"""Of the signal's RMS: a whole-record fit that leaves less is in the right basin, and no stretches are needed."""


def approached(data: Data, simulation: Simulation, still: frozenset[str] = frozenset()) -> list[Simulation]:
    """`simulation` after each length of stretches; those over which it diverges are left out."""
    found: list[Simulation] = []
    if not simulation.state:
        return found
    width_s = half_width(data.records, data.scales.rate)
    for periods in PERIODS:
        length_s = periods * 2.0 * np.pi / data.scales.rate
        sensitivity = sensitivity_of(data, simulation, still)
        own = [simulation.parameters[k].value for k in sensitivity.of_record]
        cost = SegmentCost(
            sensitivity=sensitivity,
            segments=_stretches(data, simulation, length_s, width_s, own),
            sigma=np.array([data.size(name) for name in sensitivity.outputs]),
            executor=data.executor,
            steps_per_period=data.steps_per_period,
        )
        shared = sensitivity.own_values[sensitivity.free] / sensitivity.scale
        cost = _that_run(cost, shared)
        low, high = bounds(sensitivity, data.scales)
        reached = minimise(
            cost.equations, cost.start(shared), low, high, iterations=ITERATIONS, tolerance=1e-4
        )
        if reached is not None:
            simulation = simulation.with_values(sensitivity.values(reached.unknowns.shared))
            found.append(simulation)
    return found


def over_stretches(data: Data, hypothesis: Hypothesis) -> float:
    """Cost of the fitted set over short stretches, each from a state of its own: what does not rest on a long memory.

    A body without a spring drifts, and whatever is slow fits the drift of a free run; within a stretch there is none.
    """
    simulation = hypothesis.simulation
    if not simulation.state:
        return hypothesis.cost
    apart = hypothesis.sensitivity.of_record.tolist()
    sensitivity = Sensitivity.of(simulation, data.records, apart, scales=data.scales, of_record=apart)
    own = [simulation.parameters[k].value for k in apart]
    length_s, width_s = (
        JUDGED_PERIODS * 2.0 * np.pi / data.scales.rate,
        half_width(data.records, data.scales.rate),
    )
    cost = SegmentCost(
        sensitivity=sensitivity,
        segments=_stretches(data, simulation, length_s, width_s, own),
        sigma=np.array([data.size(name) for name in sensitivity.outputs]),
        executor=data.executor,
        steps_per_period=data.steps_per_period,
    )
    nothing = np.empty(0)
    reached = minimise(
        cost.equations, cost.start(nothing), nothing, nothing, iterations=ITERATIONS, tolerance=1e-3
    )
    return np.inf if reached is None else reached.equations.cost


def _stretches(
    data: Data, simulation: Simulation, length_s: float, width_s: float, own: Sequence[float]
) -> list[Segment]:
    """At most `MOST_STRETCHES`, spread evenly over all records; `own`: what each record has for itself."""
    pieces = [piece for record in data.records for piece in cut(record, simulation, length_s, width_s)]
    chosen = np.linspace(0, len(pieces) - 1, min(MOST_STRETCHES, len(pieces))).round().astype(int)
    return [pieces[k]._replace(joined=False, start=np.append(pieces[k].start, own)) for k in chosen]


def _that_run(cost: SegmentCost, shared: FloatArray) -> SegmentCost:
    """Without the stretches that run away at once: beyond its barrier a softening spring has no motion to fit."""
    unknowns = cost.start(shared)
    kept = [segment for k, segment in enumerate(cost.segments) if cost.linearise(k, unknowns) is not None]
    return cost.at(segments=kept) if kept else cost


def fitted_nominal(data: Data, simulation: Simulation, mechanisms: Sequence[str]) -> Hypothesis | None:
    """The best fit of whole records: from the model's own values, and from those of short stretches if that is far off.

    None: it diverges from all of them.
    """
    first = fitted(data, simulation, mechanisms)
    if first is not None and misfit(data, first) < FAR:
        return first
    found = [first, *(fitted(data, start, mechanisms) for start in approached(data, simulation)[1:])]
    return min((one for one in found if one is not None), key=_cost, default=None)


def misfit(data: Data, hypothesis: Hypothesis) -> float:
    """RMS of what is left as a share of that of the signals about their means, over all outputs."""
    left = signal = 0.0
    outputs = hypothesis.sensitivity.outputs
    for name in outputs:
        readings = np.concatenate([record.measured[name][record.first :] for record in data.records])
        signal += float(np.var(readings)) / data.size(name) ** 2
        left = 2.0 * hypothesis.cost / len(readings)
    return float(np.sqrt(left / signal)) if signal > 0.0 else np.inf


def fitted_again(data: Data, hypothesis: Hypothesis) -> Hypothesis:
    """The same set from the values of short stretches, if that is better; as it is where it is not far off."""
    if misfit(data, hypothesis) < FAR:
        return hypothesis
    found = [hypothesis]
    for start in approached(data, hypothesis.simulation, hypothesis.still)[1:]:
        once = fitted(data, start, hypothesis.mechanisms, hypothesis.starts, still=hypothesis.still)
        found += [once] if once is not None else []
    return min(found, key=_cost)


def _cost(one: Hypothesis) -> float:
    return one.cost
