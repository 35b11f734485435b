"""A start for fits of whole records: the parameters that fit short stretches, each from a state of its own.

A lightly damped oscillator whose frequency is off by more than a period in Q has many minima over a whole record, and
a bistable one as many as turns; over a few periods there is one. The stretches' states settle first, each at its own
pace: one in the wrong well would drag the parameters with it, and is left out if it stays there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.progressive_fit import caught_up
from rtctl.diagnosis.problem.bounds import bounds
from rtctl.diagnosis.problem.fit import fit_hypothesis, sensitivity_of
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.least_squares.levenberg_marquardt import Unknowns, minimise
from rtctl.identification.oscillator.weak_form import choose_half_width
from rtctl.identification.simulation_error.multiple_shooting import cut_segments, fit_segment_states
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity

PERIODS = (1.0, 4.0, 16.0, 64.0)
"""Lengths of the stretches, one after the other."""
ITERATIONS = 8
MOST_STRETCHES = 30
"""Of one length, evenly over the records: a start needs no more."""
SETTLED = 0.01
ASTRAY = 25.0
"""Times the median cost of a sample."""
TRIAL = 8
"""Iterations over whole records that show which start is near."""
FITTED = 4
"""Starts, of those that are nearest, from which whole records are fitted to the end."""
JUDGED_PERIODS = 1.0
MOST_JUDGED = 160
"""Of all records together, evenly spread: each costs a simulation with a state of its own."""
FAR = 0.3
"""Of the signal's RMS: a whole-record fit that leaves less is in the right basin, and no stretches are needed."""
SHIFTED = 3.0
"""Times a record's variation that its mean is at least, where a constant of the reading may hide the motion."""
NOT_SHIFTED = 0.5
"""Of what the nominal model leaves: a fit beside a constant that leaves less shows that the constant is missing."""
STEP_ERROR = 0.01
"""Of the cost, a tenth of the residual's RMS: below, the error is taken off to first order (see `gate`)."""
FINEST_STEPS = 256.0
"""A period; then the simulation's own."""


def approached(
    problem: Problem, simulation: Simulation, still: frozenset[str] = frozenset(), *, settle: bool = True
) -> list[Simulation]:
    """`simulation` after each length of stretches; those over which it diverges are left out.

    `settle`: their states are fitted before any parameter moves, and stretches that stay astray are left out.
    """
    found: list[Simulation] = []
    if not simulation.state:
        return found
    width_s = choose_half_width(problem.records, problem.scales.rate)
    for periods in PERIODS if settle else PERIODS[1:]:
        length_s = periods * 2.0 * np.pi / problem.scales.rate
        sensitivity = sensitivity_of(problem, simulation, still)
        own = [simulation.parameters[k].value for k in sensitivity.record_parameters]
        cost = SegmentCost(
            sensitivity=sensitivity,
            segments=_stretches(
                problem, simulation, length_s, width_s, own, MOST_STRETCHES if settle else MOST_JUDGED
            ),
            sigma=np.array([problem.size(name) for name in sensitivity.outputs]),
            executor=problem.executor,
            steps_per_period=problem.steps_per_period,
        )
        shared = sensitivity.current_values[sensitivity.free] / sensitivity.scale
        cost = _that_run(cost, shared)
        cost, unknowns = _that_settle(cost, shared) if settle else (cost, cost.start(shared))
        low, high = bounds(sensitivity, problem.scales)
        reached = minimise(
            cost.equations,
            unknowns,
            low,
            high,
            iterations=ITERATIONS,
            tolerance=1e-4,
            should_stop=problem.enough,
        )
        if reached is not None:
            simulation = simulation.with_values(sensitivity.values(reached.unknowns.shared))
            found.append(simulation)
    return found


def over_stretches(problem: Problem, hypothesis: Hypothesis) -> float:
    """Cost of the fitted set over short stretches, each from a state of its own: what does not rest on a long memory.

    A body without a spring drifts, and whatever is slow fits the drift of a free run; within a stretch there is none.
    """
    if not hypothesis.simulation.state:
        return hypothesis.cost
    return _judged(problem, hypothesis)[0]


def left_over_stretches(problem: Problem, hypothesis: Hypothesis) -> float:
    """RMS of what it leaves there, over the outputs' sizes; of a simulation that has states."""
    cost, samples = _judged(problem, hypothesis)
    return float(np.sqrt(2.0 * cost / samples)) if samples else np.inf


def _judged(problem: Problem, hypothesis: Hypothesis) -> tuple[float, int]:
    """Cost over stretches, and of how many samples; infinite where one diverges."""
    simulation = hypothesis.simulation
    apart = hypothesis.sensitivity.record_parameters.tolist()
    sensitivity = Sensitivity.of(
        simulation, problem.records, apart, scales=problem.scales, record_parameters=apart
    )
    own = [simulation.parameters[k].value for k in apart]
    length_s, width_s = (
        JUDGED_PERIODS * 2.0 * np.pi / problem.scales.rate,
        choose_half_width(problem.records, problem.scales.rate),
    )
    cost = SegmentCost(
        sensitivity=sensitivity,
        segments=_stretches(problem, simulation, length_s, width_s, own, MOST_JUDGED),
        sigma=np.array([problem.size(name) for name in sensitivity.outputs]),
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
    )
    nothing = np.empty(0)
    reached = minimise(
        cost.equations, cost.start(nothing), nothing, nothing, iterations=ITERATIONS, tolerance=1e-3
    )
    samples = sum(segment.record.samples for segment in cost.segments)
    return (np.inf if reached is None else reached.equations.cost), samples


def _stretches(
    problem: Problem, simulation: Simulation, length_s: float, width_s: float, own: Sequence[float], most: int
) -> list[Segment]:
    """At most so many, spread evenly over all records; `own`: what each record has for itself."""
    pieces = [
        piece for record in problem.records for piece in cut_segments(record, simulation, length_s, width_s)
    ]
    chosen = np.linspace(0, len(pieces) - 1, min(most, len(pieces))).round().astype(int)
    return [pieces[k]._replace(joined=False, start=np.append(pieces[k].start, own)) for k in chosen]


def _that_run(cost: SegmentCost, shared: FloatArray) -> SegmentCost:
    """Without the stretches that run away at once: beyond its barrier a softening spring has no motion to fit."""
    unknowns = cost.start(shared)
    kept = [segment for k, segment in enumerate(cost.segments) if cost.linearise(k, unknowns) is not None]
    return cost.with_changes(segments=kept) if kept else cost


def _that_settle(cost: SegmentCost, shared: FloatArray) -> tuple[SegmentCost, Unknowns]:
    """States fitted alone, and without the stretches that this leaves far above the others."""
    unknowns = fit_segment_states(cost, cost.start(shared), SETTLED)
    pieces = cost.compute_terms(unknowns)
    if pieces is None:
        return cost, unknowns
    left = np.array([piece.cost for piece in pieces]) / [one.record.samples for one in cost.segments]
    kept = np.flatnonzero(left <= ASTRAY * np.median(left)).tolist()
    cost = cost.with_changes(segments=[cost.segments[k] for k in kept])
    return cost, unknowns._replace(local=unknowns.local[kept])


def fitted_nominal(problem: Problem, simulation: Simulation, mechanisms: Sequence[str]) -> Hypothesis | None:
    """The best fit of whole records, from the model's own values, or those of short stretches; None: it diverges.

    Where the lowest ends far off, from every start: a jump between motions makes many minima.
    """
    tried = [
        fit_hypothesis(problem, start, mechanisms, iterations=TRIAL)
        for start in (simulation, *_level(problem, simulation), *approached(problem, simulation))
    ]
    found = _ends(
        [fit_hypothesis(problem, one.simulation, mechanisms, one.starts) for one in _nearest(tried)]
    )
    if not found or misfit(problem, found[0]) >= FAR:
        starts = approached(problem, simulation, settle=False)
        found = _ends([*found, *(fit_hypothesis(problem, start, mechanisms) for start in starts)])
        shifted = _as_if_not_shifted(
            problem, simulation, mechanisms, misfit(problem, found[0]) if found else np.inf
        )
        found = [shifted] if shifted is not None else found
    return found[0] if found else None


def _level(problem: Problem, simulation: Simulation) -> list[Simulation]:
    """`simulation` with its offsets where they put the outputs' means right, if one is off by more than all motion."""
    if not problem.subject.offsets:
        return []
    values = np.array([one.value for one in simulation.parameters])
    names = [one.name for one in simulation.parameters]
    runs = [simulation.predict(record.stimulus, values) for record in problem.records]
    moved = values.copy()
    for output, offset in problem.subject.offsets.items():
        readings = [record.measured.get(output) for record in problem.records]
        if (
            offset not in names
            or not any(y is not None for y in readings)
            or simulation.parameters[names.index(offset)].fixed
        ):
            continue
        errors = np.concatenate(
            [y - run.outputs[output][0] for y, run in zip(readings, runs, strict=True) if y is not None]
        )
        signal = np.concatenate([y for y in readings if y is not None])
        if abs(float(errors.mean())) > SHIFTED * float(signal.std()):
            moved[names.index(offset)] += float(errors.mean())
    return [] if (moved == values).all() else [simulation.with_values(moved)]


def _as_if_not_shifted(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str], left: float
) -> Hypothesis | None:
    """The nominal model with the values of a fit beside a constant of the reading, where that is what is missing.

    A constant that is many times the motion is fitted by any other motion about that place, and no cause is a
    neighbour of that. None where it is not, or where such a fit leaves not much less than `left`.
    """
    constant = problem.subject.shifted_by
    name = problem.subject.output
    readings = [record.measured.get(name) for record in problem.records]
    if (
        not constant
        or constant in mechanisms
        or not all(
            one is not None and abs(float(one.mean())) > SHIFTED * float(one.std()) for one in readings
        )
    ):
        return None
    middle = float(np.mean([one.mean() for one in readings if one is not None]))
    beside = simulation.extended((constant,))
    values = np.array([one.value for one in beside.parameters])
    values[[one.mechanism == constant for one in beside.parameters]] = middle
    starts = [beside.with_values(values)]
    starts += approached(problem, starts[0])
    tried = _ends([fit_hypothesis(problem, start, (*mechanisms, constant)) for start in starts])
    if not tried or not misfit(problem, tried[0]) < NOT_SHIFTED * left:
        return None
    best = tried[0]
    own = best.simulation.parameters
    nominal = simulation.with_values(np.array([one.value for one in own if one.mechanism != constant]))
    return fit_hypothesis(problem, nominal, mechanisms, best.starts, iterations=0)


def _ends(found: Sequence[Hypothesis | None]) -> list[Hypothesis]:
    """Of fits, lowest cost first."""
    return sorted((one for one in found if one is not None), key=_cost)


def misfit(problem: Problem, hypothesis: Hypothesis) -> float:
    """RMS of what is left as a share of that of the signals about their means, over all outputs."""
    signal = 0.0
    for name in hypothesis.sensitivity.outputs:
        readings = np.concatenate([record.measured[name][record.first :] for record in problem.records])
        signal += float(np.sum((readings - readings.mean()) ** 2)) / problem.size(name) ** 2
    return float(np.sqrt(2.0 * hypothesis.cost / signal)) if signal > 0.0 else np.inf


def fitted_again(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """The same set from the values of short stretches, if that is better; as it is where it is not far off."""
    if misfit(problem, hypothesis) < FAR:
        return hypothesis
    mechanisms, starts, still = hypothesis.mechanisms, hypothesis.starts, hypothesis.still
    tried = [
        fit_hypothesis(problem, start, mechanisms, starts, TRIAL, still)
        for start in approached(problem, hypothesis.simulation, still)
    ]
    found = [
        fit_hypothesis(problem, one.simulation, mechanisms, one.starts, still=still)
        for one in _nearest(tried)
    ]
    return _ends([hypothesis, *found])[0]


def _nearest(tried: Sequence[Hypothesis | None]) -> list[Hypothesis]:
    """Those that are worth a fit."""
    return sorted((one for one in tried if one is not None), key=_cost)[:FITTED]


def finely(problem: Problem, nominal: Hypothesis) -> tuple[Problem, Hypothesis]:
    """Data with steps so fine that they are not the error, and the nominal model fitted with them to every record.

    Near a ridge between two wells, or over many periods of a light damping, the steps that suit most records leave
    more than the noise does.
    """
    return fine_enough(problem, caught_up(problem, nominal), caught_up)


def fine_enough(
    problem: Problem,
    one: Hypothesis,
    correct: Callable[[Problem, Hypothesis], Hypothesis] = lambda problem, one: one,
) -> tuple[Problem, Hypothesis]:
    """Data with steps so fine that they are not the error of `one`, and that fitted with them and `put_right`; the same
    data where they are.
    """
    while problem.steps_per_period is not None and _step_error(problem, one) > STEP_ERROR * one.cost:
        steps = 2.0 * problem.steps_per_period
        problem = replace(problem, steps_per_period=steps if steps <= FINEST_STEPS else None)
        again = fit_hypothesis(problem, one.simulation, one.mechanisms, one.starts, still=one.still)
        one = correct(problem, again) if again is not None else one
    return problem, one


def _step_error(problem: Problem, one: Hypothesis) -> float:
    """What the steps add to the outputs, on the scale of the cost; infinite where fine ones diverge."""
    total = 0.0
    for index, record in enumerate(problem.records):
        lanes = (one.values_of(index)[None], one.start(index)[None])
        coarse = one.simulation.predict(record.stimulus, *lanes, problem.steps_per_period)
        fine = one.simulation.predict(record.stimulus, *lanes)
        for name in one.sensitivity.outputs:
            error = (coarse.outputs[name] - fine.outputs[name])[0, record.first :] / problem.size(name)
            total += 0.5 * float(error @ error)
    return total if np.isfinite(total) else np.inf


def _cost(one: Hypothesis) -> float:
    return one.cost
