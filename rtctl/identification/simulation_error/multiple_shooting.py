"""Multiple shooting: records cut into short free runs with their own initial states, which are then joined.

For chaotic or bistable motion a long free run does not determine the parameters: two runs from nearly the same start
diverge exponentially, so the cost has many local minima. Segments of a few periods do not diverge. Their continuity is
enforced ever more strictly, as long as the residual does not grow. States start from local polynomials, never
from differences.

Mechanisms with a memory or a clock of their own restart with each segment.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, Unknowns, minimise
from rtctl.identification.regression.initial_state import estimate_initial_state
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.inference import infer
from rtctl.identification.simulation_error.output_error import (
    FitOptions,
    ReportProgress,
    compute_signal_sizes,
    compute_weights,
)
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.identification.threads import open_thread_pool

MIN_SEGMENT_SAMPLES = 8
"""Samples below which a segment hardly determines its own state."""
MOST_SCREENED = 256
"""Segments by which several starts are compared: so many tell one minimum from another, however long the records."""
STATE_ITERATIONS = 8
MAX_RESIDUAL_GROWTH = 1.05
"""Ratio of residuals above which the continuity is too strict for this model."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShootingOptions:
    """Options of a fit by multiple shooting."""

    segment_periods: float = 1.0
    """Length of a segment in dominant periods."""
    gaps: tuple[float, ...] = (3.0, 1.0, 0.3)
    """Allowed gaps between segments, in standard errors of a state from one segment; tried in this order."""
    most_left: float = math.inf
    """What segments by themselves may leave (RMS, as a share of an output's size) to be joined: joined they leave
    more."""
    fit: FitOptions = FitOptions()  # noqa: RUF009 - frozen, so one may serve all


def fit_multiple_shooting(
    simulation: Simulation,
    records: Sequence[FitRecord],
    options: ShootingOptions | None = None,
    *,
    starts: Sequence[FloatArray] = (),
    free: Sequence[int] | None = None,
    report: ReportProgress = lambda text, share: None,
) -> Fit:
    """Fit the free parameters by multiple shooting; the arguments are those of `fit_output_error`.

    Raises:
        FitError: A segment diverges from every start.
    """
    options = options or ShootingOptions()
    scales = estimate_scales(records)
    sensitivity = Sensitivity.of(simulation, records, free, scales=scales)
    length_s = options.segment_periods * 2.0 * np.pi / scales.rate
    width_s = choose_half_width(records, scales.rate)
    segments = [one for record in records for one in cut_segments(record, simulation, length_s, width_s)]
    with open_thread_pool(options.fit.threads) as executor:
        cost = SegmentCost(
            sensitivity=sensitivity,
            segments=segments,
            sigma=compute_signal_sizes(sensitivity, records),
            executor=executor,
            steps_per_period=options.fit.coarse_steps_per_period,
        )
        found = _fit_unjoined(cost, starts or [sensitivity.current_values], options.fit)
        report("segments by themselves", 0.3)
        cost, found = _close_gaps(cost, found, options, report)
        cost = cost.with_changes(steps_per_period=None)
        low, high = sensitivity.bounds
        last = minimise(cost.equations, found.unknowns, low, high, iterations=options.fit.final_iterations)
        return infer("multiple_shooting", cost, last or found)


def cut_segments(record: FitRecord, simulation: Simulation, length_s: float, width_s: float) -> list[Segment]:
    """Cut a record into segments that each end with the next one's first sample; states by local polynomials.

    Args:
        record: Record to cut from its first scored sample on.
        simulation: Names the states.
        length_s: Approximate length of a segment [s].
        width_s: Half-width of the weak form [s], which sets the reach of the polynomials.
    """
    wanted = max(MIN_SEGMENT_SAMPLES, round(length_s / record.period_s))
    begin = record.first
    count = max(1, round((record.samples - 1 - begin) / wanted))
    edges = np.linspace(begin, record.samples - 1, count + 1).round().astype(int).tolist()
    return [
        Segment(
            record.cut(a, b + 1),
            estimate_initial_state(record, a, width_s, simulation.state),
            joined=b < edges[-1],
        )
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]


def _fit_unjoined(cost: SegmentCost, starts: Sequence[FloatArray], options: FitOptions) -> Minimum:
    """Fit the segments without continuity from each start, and return the best.

    Several starts are compared by some of many segments, spread over the records; the best one is then fitted to all.

    Raises:
        FitError: A segment diverges from every start.
    """
    low, high = cost.sensitivity.bounds

    def fit(some: SegmentCost, shared: FloatArray) -> Minimum | None:
        states = fit_segment_states(some, some.start(shared))
        return minimise(some.equations, states, low, high, iterations=options.screening_iterations)

    begin = [np.clip(start[cost.sensitivity.free] / cost.sensitivity.scale, low, high) for start in starts]
    count = len(cost.segments)
    if len(starts) > 1 and count > MOST_SCREENED:
        places = np.linspace(0, count - 1, MOST_SCREENED).round().astype(int).tolist()
        some = cost.with_changes(segments=[cost.segments[k] for k in places])
        screened = [found for shared in begin if (found := fit(some, shared)) is not None]
        begin = [found.unknowns.shared for found in sorted(screened, key=lambda found: found.equations.cost)]
        reached = next((found for shared in begin if (found := fit(cost, shared)) is not None), None)
    else:
        every = [found for shared in begin if (found := fit(cost, shared)) is not None]
        reached = min(every, key=lambda found: found.equations.cost, default=None)
    if reached is None:
        raise FitError(
            f"the model diverges within a segment from each of {len(starts)} starts; give a start model by --model"
        )
    return reached


def fit_segment_states(cost: SegmentCost, unknowns: Unknowns, least_gain: float = 0.0) -> Unknowns:
    """Fit only the states, each segment with its own damping: one near a ridge would slow down all the others.

    Args:
        cost: Cost of segments that are not joined.
        unknowns: Start; its shared unknowns stay.
        least_gain: Stop where the sum of costs falls by less than this share of it.
    """
    q = unknowns.local.shape[1]
    damping = np.full(len(unknowns.local), 1e-3)
    here = cost.compute_terms(unknowns)
    for _ in range(STATE_ITERATIONS):
        if here is None or q == 0:
            break
        curvature = np.array([piece.local for piece in here])
        gradient = np.array([piece.local_gradient for piece in here])
        floor = 1e-12 * curvature.max()
        diagonal = np.einsum("kii->ki", curvature)
        diagonal += damping[:, None] * diagonal + floor
        own = unknowns.local - np.linalg.solve(curvature, gradient[:, :, None])[:, :, 0]
        trial = cost.compute_terms(unknowns._replace(local=own))
        if trial is None:
            damping *= 10.0
            continue
        better = np.array([there.cost < piece.cost for there, piece in zip(trial, here, strict=True)])
        unknowns = unknowns._replace(local=np.where(better[:, None], own, unknowns.local))
        before = sum(piece.cost for piece in here)
        here = [there if took else piece for there, piece, took in zip(trial, here, better, strict=True)]
        damping = np.where(better, damping / 5.0, damping * 5.0)
        gained = before - sum(piece.cost for piece in here)
        if better.any() and gained < least_gain * before:
            break
    return unknowns


def _close_gaps(
    cost: SegmentCost, found: Minimum, options: ShootingOptions, report: ReportProgress
) -> tuple[SegmentCost, Minimum]:
    """Tighten the continuity step by step, as long as the residual does not grow."""
    low, high = cost.sensitivity.bounds
    sizes, sigma = cost.sigma, compute_weights(cost, found)
    cost = cost.with_changes(sigma=sigma)
    if (sigma > options.most_left * sizes).all():
        return cost, found
    equations = cost.equations(found.unknowns)
    if equations is None or not any(segment.joined for segment in cost.segments):
        return cost, found
    errors = np.sqrt(np.median(np.linalg.inv(equations.diagonal).diagonal(axis1=1, axis2=2), axis=0))
    one = errors * cost.sensitivity.state_scale
    names = cost.sensitivity.simulation.state
    size = np.array([one[names.index(name)] for name in cost.sensitivity.continued])
    found = found._replace(equations=equations)
    for number, factor in enumerate(options.gaps):
        stricter = replace(cost, gap=factor * size)
        trial = minimise(
            stricter.equations, found.unknowns, low, high, iterations=options.fit.iterations, tolerance=1e-6
        )
        report("segments pulled together", 0.3 + 0.6 * (number + 1) / len(options.gaps))
        if trial is None or (compute_weights(stricter, trial) > MAX_RESIDUAL_GROWTH * sigma).any():
            break
        cost, found = stricter, trial._replace(iterations=found.iterations + trial.iterations)
    return cost, found
