"""Output-error least squares: free runs over whole records against the measurement, for any `Simulation`.

Starts are screened with few iterations and coarse steps, the best is polished, and the last iterations take the
simulation's own step. Outputs are weighted by their residuals. Intervals come from a sandwich: curvature by the
sensitivities, scatter by the residuals' own colour (an autoregression), because residuals are seldom white.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.options import LARGEST_SEED, check_integer
from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord, response_of
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, minimise
from rtctl.identification.regression.initial_state import estimate_initial_state, read_initial_state
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.inference import infer
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.identification.threads import open_thread_pool

MIN_SCREENED_SAMPLES = 200
"""Samples below which a record is taken whole."""
ReportProgress = Callable[[str, float], None]
"""Receives what is under way and the share of all work that is done (0 to 1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitOptions:
    """Options of an output-error fit."""

    free_start: bool = True
    """Whether each record's initial state is fitted too: its first sample is noisy, and what ran before is unknown."""
    coarse_steps_per_period: float = 64.0
    screening_iterations: int = 12
    screening_periods: float = 40.0
    """Dominant periods of each record on which the starts are compared."""
    iterations: int = 80
    final_iterations: int = 8
    threads: int = max(1, min(2, os.cpu_count() or 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiStartOptions:
    """Options of an identification that fits from several starts."""

    starts: int = 6
    """Starts that are tried."""
    seed: int = 0
    fit: FitOptions = field(default_factory=FitOptions)

    def __post_init__(self) -> None:
        check_integer("starts", self.starts, 1, 64, "starts of each fit")
        check_integer("seed", self.seed, 0, LARGEST_SEED)


def fit_output_error(
    simulation: Simulation,
    records: Sequence[FitRecord],
    options: FitOptions | None = None,
    *,
    starts: Sequence[FloatArray] = (),
    free: Sequence[int] | None = None,
    report: ReportProgress = lambda text, share: None,
) -> Fit:
    """Fit the parameters that are not fixed, or those with the indices `free`.

    Args:
        simulation: Model to fit.
        records: Records to fit it to.
        options: Numbers of iterations and periods.
        starts: Full parameter vectors (parameters,); without any the simulation's own values.
        free: Indices of the parameters to fit.
        report: Receives the progress.

    Raises:
        FitError: The model diverges from every start.
    """
    options = options or FitOptions()
    scales = estimate_scales(records)
    sensitivity = Sensitivity.of(simulation, records, free, free_start=options.free_start, scales=scales)
    width_s = choose_half_width(records, scales.rate)
    with open_thread_pool(options.threads) as executor:

        def cost_over(parts: Sequence[FitRecord]) -> SegmentCost:
            return SegmentCost(
                sensitivity=sensitivity,
                segments=[
                    Segment(one, _choose_initial_state(one, simulation, width_s, options), False)
                    for one in parts
                ],
                sigma=compute_signal_sizes(sensitivity, records),
                executor=executor,
                steps_per_period=options.coarse_steps_per_period,
            )

        span_s = options.screening_periods * 2.0 * np.pi / scales.rate
        shown = [cut_liveliest(one, span_s) for one in records] if options.free_start else records
        tried = starts or [sensitivity.current_values]
        screened = _screen_starts(cost_over(shown), tried, options, report)
        untouched = [_scale_start(sensitivity, start) for start in tried]
        cost, found = _find_first_bounded(cost_over(records), [*screened, *untouched], options)
        cost, found = polish(cost, found, options, report)
        return infer("output_error", cost, found)


def cut_liveliest(record: FitRecord, span_s: float) -> FitRecord:
    """Return a part of `record` of length `span_s` that ends a quarter of it after the largest response.

    Starts are compared on it: it is cheap, and the basin of a short record is wide.
    """
    length = round(span_s / record.period_s)
    if length < MIN_SCREENED_SAMPLES or record.samples - record.first <= 2 * length:
        return record
    peak = record.first + int(np.abs(record.measured[response_of([record])][record.first :]).argmax())
    end = min(max(peak + length // 4, record.first + length), record.samples)
    return record.cut(end - length, end)


def compute_signal_sizes(sensitivity: Sensitivity, records: Sequence[FitRecord]) -> FloatArray:
    """Return the RMS (outputs,) of the measured outputs, the first weights."""
    sizes = [
        np.sqrt(np.mean(np.concatenate([one.measured[name][one.first :] for one in records]) ** 2))
        for name in sensitivity.outputs
    ]
    found: FloatArray = np.maximum(np.array(sizes), 1e-300)
    return found


def polish(
    cost: SegmentCost, found: Minimum, options: FitOptions, report: ReportProgress = lambda text, share: None
) -> tuple[SegmentCost, Minimum]:
    """Iterate to convergence with outputs reweighted, the last iterations at the simulation's own step."""
    low, high = cost.sensitivity.bounds
    iterations = found.iterations
    stages = [(cost.steps_per_period, options.iterations), (None, options.final_iterations)]
    for number, (steps, most) in enumerate(stages):
        report("fitting", 0.6 + 0.2 * number)
        cost = cost.with_changes(steps_per_period=steps, sigma=compute_weights(cost, found))
        reached = minimise(cost.equations, found.unknowns, low, high, iterations=most)
        if reached is None:
            break
        iterations += reached.iterations
        found = reached
    return cost, found._replace(iterations=iterations)


def compute_weights(cost: SegmentCost, found: Minimum) -> FloatArray:
    """Return the RMS residual (outputs,); an output that is fitted exactly keeps a floor."""
    pieces = cost.compute_terms(found.unknowns)
    if pieces is None:
        return cost.sigma
    scored = sum(
        segment.record.samples - segment.record.first - int(segment.joined) for segment in cost.segments
    )
    rms = np.sqrt(np.sum([piece.square for piece in pieces], axis=0) / scored)
    records = [segment.record for segment in cost.segments]
    weights: FloatArray = np.maximum(rms, 1e-12 * compute_signal_sizes(cost.sensitivity, records))
    return weights


def _choose_initial_state(
    record: FitRecord, simulation: Simulation, width_s: float, options: FitOptions
) -> FloatArray:
    """Return the state to start from: estimated where it is free, else as the record gives it."""
    if options.free_start:
        return estimate_initial_state(record, 0, width_s, simulation.state)
    return read_initial_state(record, simulation.state)


def _screen_starts(
    cost: SegmentCost, starts: Sequence[FloatArray], options: FitOptions, report: ReportProgress
) -> list[FloatArray]:
    """Return the point (p,) that a few iterations reach from each start, lowest cost first; drop those that diverge."""
    low, high = cost.sensitivity.bounds
    reached = []
    for number, start in enumerate(starts):
        shared = _scale_start(cost.sensitivity, start)
        found = minimise(
            cost.equations, cost.start(shared), low, high, iterations=options.screening_iterations
        )
        if found is not None:
            reached.append((found.equations.cost, number, found.unknowns.shared))
        report("screening starts", 0.5 * (number + 1) / len(starts))
    return [shared for _, _, shared in sorted(reached, key=lambda one: one[:2])]


def _scale_start(sensitivity: Sensitivity, start: FloatArray) -> FloatArray:
    """Return the free parameters (p,) of a full vector, scaled and within bounds."""
    low, high = sensitivity.bounds
    return np.asarray(np.clip(start[sensitivity.free] / sensitivity.scale, low, high), np.float64)


def _find_first_bounded(
    cost: SegmentCost, screened: Sequence[FloatArray], options: FitOptions
) -> tuple[SegmentCost, Minimum]:
    """Return the first start that does not diverge over the whole records. Raises FitError."""
    low, high = cost.sensitivity.bounds
    for shared in screened:
        found = minimise(
            cost.equations, cost.start(shared), low, high, iterations=options.screening_iterations
        )
        if found is not None:
            return cost, found
    raise FitError(
        "the model diverges from every start: it is unbounded there or far from the data; give a start model by "
        "--model"
    )
