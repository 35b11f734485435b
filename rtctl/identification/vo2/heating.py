"""Time constant of the heating from transients, by output error.

    ds/dt = (i^2 - s) / tau,   v = sqrt(s)

s is the surrogate of the temperature rise as a current's square [mA^2]: at rest s = i^2, so the hysteresis models
identified on staircases apply to v as they are, and only tau remains to be identified (paper, equations 1 and 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.measured.dataset import Record

MIN_MOVING_SAMPLES = 20
MOVING_SAMPLES = 9
MOVING_TIME_CONSTANTS = 5.0
"""Time constants after a change of current in which samples count as moving; `MOVING_SAMPLES` at least."""
SEARCH_FACTOR = 10.0  # about the nominal value, either way
SCALES = (1.0, 30.0, 900.0, 1.0 / 30.0)
"""Multiples of the nominal value about which the search runs, one after the other, until one shows: their ranges
overlap, from 5 us to 16 s about 1.8 ms."""
READS_AFTER_ROWS = 0.5
READS_AFTER_ERRORS = 4.0
"""Rows after its current at which a row is read, by a fit of that and of the time constant together, and its standard
errors, above which readings at the end of a period are believed, if they also leave less. Of twelve foreign devices
with nothing hidden (`benchmarks/static_loop_errors.py`, seeds 200 to 203) the four that are read there leave 0.26 of
what readings at the start leave at most, the eight that are read at the start 2.0 at least; with films of ten periods
and hidden effects it was 0.87 to 0.95, and the fit gave 0.93 to 1.6 rows."""
LEAST_OWN_SHARE = 0.5
"""Share of what a row's own current would do until its end below which, by three standard errors, readings at the end
of a period are refuted: whatever a film does later, nothing moves before its cause."""
LEAST_STEPS = 10
"""Steps after a rest by which that is judged at all."""
LN_STEP = 0.01
"""Step of the logarithm of the time constant by which residuals are differentiated."""
READ_OUT_SHARE = 5e-4  # of tau: as far as it moves between read-outs of 20 and 60 cells on the same data


class ReadOut(Protocol):
    """Static hysteresis model of one output against v [mA]."""

    def simulate(self, v: FloatArray) -> FloatArray:
        """Return the output for each v, from the state that a full cooling leaves."""
        ...


class TimeConstant(NamedTuple):
    """Time constant tau [s], its standard error, the number of moving samples it rests on, and when these are taken."""

    value_s: float
    standard_error_s: float
    samples: int
    reads_after: bool = False
    """Whether a row's readings are taken at the end of the period in which its current acts; else at its start."""


@kernel
def simulate_heating(current_mA: FloatArray, period_s: float, time_constant_s: float) -> FloatArray:
    """Return the surrogate v (n,) [mA] at the sample instants, before each sample's current takes effect.

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


def simulate_read_heating(
    current_mA: FloatArray, period_s: float, time_constant_s: float, *, reads_after: bool
) -> FloatArray:
    """Return the surrogate v (n,) [mA] at the readings of each row.

    These are taken before the row's current acts, as `simulate_heating` has them, or after it has acted for a period.
    """
    if not reads_after:
        return simulate_heating(current_mA, period_s, time_constant_s)
    return simulate_heating(np.append(current_mA, current_mA[-1:]), period_s, time_constant_s)[1:]


def prepend_full_cooling(v: FloatArray) -> FloatArray:
    """Return v with one sample far below in front, which resets any hysteresis model."""
    return np.concatenate((np.zeros(1), v))


def find_time_constant(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float
) -> TimeConstant | None:
    """Fit the time constant of a device of any speed: `fit_time_constant` about several scales of the nominal value.

    A scale counts if the better of both ways to read has its minimum in the range that is searched about it: the other
    way may have one there that is none of the film's.
    """
    outside = None
    for scale in SCALES:
        found, is_within = _fit_about(records, resistance, deflection, scale * nominal_s)
        if found is not None and is_within:
            return found
        outside = outside or found
    return outside


def fit_time_constant(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float
) -> TimeConstant | None:
    """Fit the time constant, with readings at the start of a row's period, or at its end where that certainly fits.

    A sample that is missing between current and reading would be taken for a slower or faster film. The staircases may
    tell it alone: what began to act after them delays or hastens the readings of other records. See
    `fit_with_readings`.
    """
    return _fit_about(records, resistance, deflection, nominal_s)[0]


def _fit_about(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float
) -> tuple[TimeConstant | None, bool]:
    """Return what `fit_time_constant` does, and whether the better way to read has its minimum in the range."""
    both = _fit_both_ways(records, resistance, deflection, nominal_s)
    is_after = both.is_after
    staircases = [record for record in records if record.use == "identify"]
    if both.after is not None and not is_after and len(staircases) < len(records):
        is_after = _fit_both_ways(staircases, resistance, deflection, nominal_s).is_after
    return both.after if is_after else both.usual, both.is_within


class _BothWays(NamedTuple):
    """Fits with readings at the start and at the end of a period."""

    usual: TimeConstant | None
    after: TimeConstant | None
    is_after: bool
    """Whether readings at the end certainly fit."""
    is_within: bool
    """Whether the way that fits better has its minimum in the range that was searched."""


def _fit_both_ways(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float
) -> _BothWays:
    (usual, least), (after, cost) = (
        fit_with_readings(records, resistance, deflection, nominal_s, reads_after=after)
        for after in (False, True)
    )
    if after is None or not cost < least:
        return _BothWays(usual, after, False, not cost < least)
    rows, error = estimate_reading_instant(records, resistance, deflection, nominal_s, after.value_s)
    certain = rows > max(READS_AFTER_ROWS, READS_AFTER_ERRORS * error)
    is_after = certain and answers_own_current(records, resistance, deflection, after.value_s)
    return _BothWays(usual, after, is_after, True)


def answers_own_current(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, tau_s: float
) -> bool:
    """Return whether the reading of a row may answer the row's own current, by the first row of each step from rest.

    A second, slower time constant looks like a film of one that is read late; but what is read at the start of a
    period shows nothing of a step in its first row, whatever the film does then.

    Args:
        records: Records with transients.
        resistance: Read-out of -ln R.
        deflection: Read-out of the deflection, where there is one.
        tau_s: Time constant [s] with readings at the end of a period.
    """
    steps = [_find_steps_from_rest(record, tau_s) for record in records]
    before = [np.append(mask[1:], False) for mask in steps]
    if sum(int(mask.sum()) for mask in steps) < LEAST_STEPS:
        return True  # nothing tells

    def change(*, reads_after: bool) -> FloatArray:
        at, earlier = (
            _compute_residuals(records, masks, resistance, deflection, tau_s, reads_after=reads_after)
            for masks in (steps, before)
        )
        return at - earlier

    measured = -change(reads_after=False)  # a film that is read before its current acts is still at rest
    expected = measured + change(reads_after=True)
    size = float(expected @ expected)
    if size == 0.0:
        return True
    share = float(measured @ expected) / size
    left = measured - share * expected
    error = math.sqrt(float(left @ left) / (max(len(left) - 1, 1) * size))
    return share + 3.0 * error > LEAST_OWN_SHARE


def _find_steps_from_rest(record: Record, tau_s: float) -> NDArray[np.bool_]:
    """Return a mask of the rows in which the current changes after it was held long enough to settle."""
    current = record.signals["current"]
    rest = max(2, math.ceil(MOVING_TIME_CONSTANTS * tau_s / record.period_s))
    changed = np.append(False, np.diff(current) != 0.0)
    held = np.cumsum(changed)
    mask = changed.copy()
    mask[: rest + 1] = False
    late = np.flatnonzero(mask)
    mask[late] = held[late - 1] == held[late - rest]
    mask[: record.ignore_first + 1] = False
    return mask


def estimate_reading_instant(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, nominal_s: float, tau_s: float
) -> tuple[float, float]:
    """Estimate when a row is read, by one linear step for that and for the time constant together.

    Args:
        records: Records with transients.
        resistance: Read-out of -ln R.
        deflection: Read-out of the deflection, where there is one.
        nominal_s: Nominal time constant [s], by which samples count as moving.
        tau_s: Time constant [s] at which the residuals are linearised.

    Returns:
        The instant, 0 for the start of the row's period and 1 for its end, and its standard error; a read-out errs
        alike all along a hold, so holds count, not samples.
    """
    usable, masks = _find_moving_records(records, nominal_s)

    def residual(tau: float, *, reads_after: bool) -> FloatArray:
        return _compute_residuals(usable, masks, resistance, deflection, tau, reads_after=reads_after)

    at_start, at_end = residual(tau_s, reads_after=False), residual(tau_s, reads_after=True)
    longer, shorter = (residual(tau_s * math.exp(by), reads_after=True) for by in (LN_STEP, -LN_STEP))
    slopes = np.stack([(longer - shorter) / (2.0 * LN_STEP), at_end - at_start])
    gram = np.linalg.pinv(slopes @ slopes.T)
    change = -gram @ (slopes @ at_end)
    left = at_end + change @ slopes
    holds = _number_holds(usable, masks, deflection is not None)
    scores = np.stack([np.bincount(holds, weights=slope * left) for slope in slopes])
    spread = gram @ (scores @ scores.T) @ gram
    return 1.0 + float(change[1]), math.sqrt(max(float(spread[1, 1]), 0.0))


# six parameters because a read-out and its instant belong to neither the records nor the search
def fit_with_readings(
    records: Sequence[Record],
    resistance: ReadOut,
    deflection: ReadOut | None,
    nominal_s: float,
    *,
    reads_after: bool,
) -> tuple[TimeConstant | None, float]:
    """Fit the time constant to the moving samples.

    Residuals are relative to each record's range. A read-out errs alike all along a hold, so the standard error counts
    holds, not samples, and a read-out on a grid of finite cells adds `READ_OUT_SHARE`.

    Args:
        records: Records with transients.
        resistance: Read-out of -ln R.
        deflection: Read-out of the deflection, where there is one.
        nominal_s: Nominal time constant [s] about which the search runs.
        reads_after: Whether a row is read after its current has acted for a period.

    Returns:
        The time constant, None where it cannot be seen (sampled too slowly, too few samples, or out of range), and the
        least sum of squared residuals, each over its record's range; also that of a film that settles at once.
    """
    usable, masks = _find_moving_records(records, nominal_s)
    moving = sum(int(mask.sum()) for mask in masks)
    if moving < MIN_MOVING_SAMPLES:
        return None, math.inf

    def residual(ln_tau: float) -> FloatArray:
        tau_s = math.exp(ln_tau)
        return _compute_residuals(usable, masks, resistance, deflection, tau_s, reads_after=reads_after)

    def cost(ln_tau: float) -> float:
        error = residual(ln_tau)
        return float(error @ error)

    bounds = math.log(nominal_s / SEARCH_FACTOR), math.log(nominal_s * SEARCH_FACTOR)
    best = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-4}).x)
    at_once = math.log(1e-3 * min(record.period_s for record in usable))  # settled within a sample
    lowest, elsewhere = cost(best), min(map(cost, (at_once, *bounds)))
    if min(best - bounds[0], bounds[1] - best) < 0.01 or lowest >= elsewhere:
        return None, min(lowest, elsewhere)
    slope = (residual(best + LN_STEP) - residual(best - LN_STEP)) / (2.0 * LN_STEP)
    scores = np.bincount(_number_holds(usable, masks, deflection is not None), weights=slope * residual(best))
    information = float(slope @ slope)
    if not information > 0.0:
        return None, lowest
    tau = math.exp(best)
    relative = math.hypot(float(np.linalg.norm(scores)) / information, READ_OUT_SHARE)
    return TimeConstant(tau, tau * relative, moving, reads_after), lowest


def _find_moving_records(
    records: Sequence[Record], nominal_s: float
) -> tuple[list[Record], list[NDArray[np.bool_]]]:
    """Return the records that are sampled fast enough to show the heating, and which of their samples move."""
    usable = [record for record in records if record.period_s < 2.0 * nominal_s and shows_heating(record)]
    return usable, [_find_moving_samples(record, nominal_s) for record in usable]


def shows_heating(record: Record) -> bool:
    """Return whether a record has rows between the ends of its holds; one row a hold is at rest in each."""
    changes = int(np.count_nonzero(np.diff(record.signals["current"])))
    return record.use != "identify" or changes < 0.5 * record.samples


def _find_moving_samples(record: Record, time_constant_s: float) -> NDArray[np.bool_]:
    """Return a mask of the samples that move after a change.

    Row k is measured before its own current acts. The first ones of a record that is no staircase do not count: where
    the device was before is not known.
    """
    count = max(MOVING_SAMPLES, round(MOVING_TIME_CONSTANTS * time_constant_s / record.period_s))
    current = record.signals["current"]
    changed = np.flatnonzero(np.diff(current) != 0.0) + 1
    edges = np.zeros(len(current) + 1, dtype=np.intp)
    np.add.at(edges, np.minimum(changed + 1, len(current)), 1)
    np.add.at(edges, np.minimum(changed + 1 + count, len(current)), -1)
    mask = np.cumsum(edges[:-1]) > 0
    mask[: max(record.ignore_first, 0 if record.use == "identify" else count)] = False
    return mask


def _number_holds(
    records: Sequence[Record], masks: Sequence[NDArray[np.bool_]], with_deflection: bool
) -> NDArray[np.intp]:
    """Return the number of the hold of each residual, in the order of the residuals."""
    parts: list[NDArray[np.intp]] = []
    first = 0
    for record, mask in zip(records, masks, strict=True):
        hold = first + np.cumsum(np.diff(record.signals["current"], prepend=np.nan) != 0.0)
        parts += [hold[mask]] * (2 if with_deflection and record.has("deflection") else 1)
        first = int(hold[-1])
    return np.concatenate(parts)


# six parameters because a read-out and its instant belong to neither the records nor the search
def _compute_residuals(
    records: Sequence[Record],
    masks: Sequence[NDArray[np.bool_]],
    resistance: ReadOut,
    deflection: ReadOut | None,
    tau_s: float,
    *,
    reads_after: bool,
) -> FloatArray:
    """Return the errors of the moving samples of all records, one record after the other."""
    parts = [
        _compute_residual(record, mask, resistance, deflection, tau_s, reads_after=reads_after)
        for record, mask in zip(records, masks, strict=True)
    ]
    return np.concatenate(parts)


def _compute_residual(
    record: Record,
    moving: NDArray[np.bool_],
    resistance: ReadOut,
    deflection: ReadOut | None,
    tau_s: float,
    *,
    reads_after: bool,
) -> FloatArray:
    """Return errors of the `moving` samples relative to the record's range: resistance, then deflection if present."""
    heated = simulate_read_heating(record.signals["current"], record.period_s, tau_s, reads_after=reads_after)
    v = prepend_full_cooling(heated)
    reading = -np.log(record.signals["resistance"])
    parts = [(resistance.simulate(v)[1:] - reading)[moving] / max(float(np.ptp(reading)), 1e-9)]
    if deflection is not None and record.has("deflection"):
        measured = record.signals["deflection"]
        parts.append((deflection.simulate(v)[1:] - measured)[moving] / max(float(np.ptp(measured)), 1e-9))
    return np.concatenate(parts)
