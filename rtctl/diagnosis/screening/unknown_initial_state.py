"""Records whose history before the first sample is unknown: what a device remembers of it must not be scored.

The initial motion is fitted, but the internal state of a lag, a delay, a yielding force or a second mass would be taken
to be at rest. The traces of a wrong one in the first periods decide between causes that are the same law otherwise. So
the first periods of a record that begins in motion start the state and are not scored. The same holds for a plant with
memory whose record does not begin where a full cooling leaves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.screening.screened import Screened
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import FitRecord

# Median size of the fourth differences of white noise of variance 1 (variance 70, normal).
NOISE_OF_DIFFERENCES = 0.6745 * 70.0**0.5
BEGINS_IN_MOTION = (
    "{} of {} records begin in motion: what acted before their first sample is not known, so their first {:.3g} s "
    "start the state and are not scored"
)
BEGINS_DRIVEN = (
    "the drive of {} of {} records is not zero at their first sample, and what it was before is not known: a device "
    "that feels its drive late feels that at first, so their first {:.3g} s are not scored"
)
BEGINS_SLOWLY = (
    "{} of {} records begin with a small motion: what a reading that lags was before is not known, so their first "
    "{:.3g} s are not scored"
)
UNKNOWN_HISTORY = (
    "{} not begin where a full cooling leaves the device (the first readings are off by {:.0%} of the signal's RMS): "
    "what acted before is not known, so the first {:.3g} s, until that is forgotten, are not scored. Was the record "
    "cut from a longer one?"
)


class _InitialMotion(NamedTuple):
    """Displacement and velocity at a record's first sample, in units of the RMS of its displacement about the mean."""

    displacement: float = 0.0
    velocity: float = 0.0
    """Over the dominant angular frequency."""
    error: float = 0.0
    """Standard error of `velocity` by noise."""
    units_per_s: float = 0.0
    """Signed velocity, in the displacement's unit per second."""
    declared: bool = False
    """Whether the manifest says where the record begins."""

    def moves(self, thresholds: ScreeningThresholds) -> bool:
        """Return whether the record certainly begins in motion."""
        least = thresholds.moving_start * max(1.0, self.displacement)
        return self.velocity > max(least, thresholds.moving_start_errors * self.error)

    def creeps(self, thresholds: ScreeningThresholds) -> bool:
        """Return whether the record certainly begins with a motion, however small."""
        return self.velocity > max(thresholds.creeping_start, thresholds.moving_start_errors * self.error)

    def rests(self, thresholds: ScreeningThresholds) -> bool:
        """Return whether the record begins at rest, as far as can be seen."""
        is_still = self.velocity < thresholds.resting_start * max(1.0, self.displacement)
        return is_still and (self.declared or self.displacement < thresholds.resting_start)


class _History(NamedTuple):
    """How long the history of a plant with memory is visible in a record."""

    samples: int = 0
    """Samples until the error is as usual; 0 where the record begins so, or never becomes so."""
    offset: float = 0.0
    """Error of the first readings over the signal's RMS."""


def warm_up_moving_records(
    screened: Screened, rate: float, thresholds: ScreeningThresholds, *, two_wells: bool = False
) -> Screened:
    """Leave the first periods of records that begin in motion unscored, and give them their initial velocity.

    Args:
        screened: Records to fit and to test on.
        rate: Dominant angular frequency of the motion [1/s].
        thresholds: Thresholds of the screening.
        two_wells: Whether the motion has two wells, where fewer periods warm up.
    """
    records = [*screened.fit, *screened.tests]
    motions = [_initial_motion(record, rate, thresholds) for record in records]
    period_s = 2.0 * np.pi / rate
    moved = any(motion.moves(thresholds) for motion in motions)
    warm, notes = [], []
    begun: dict[str, list[FitRecord]] = {BEGINS_IN_MOTION: [], BEGINS_DRIVEN: [], BEGINS_SLOWLY: []}
    for record, motion in zip(records, motions, strict=True):
        if moved and not motion.rests(thresholds):
            known, why = _warm_up(record, period_s, thresholds, two_wells), BEGINS_IN_MOTION
        elif _is_driven_at_first(record, thresholds):
            known, why = _skip_first_readings(record, period_s, thresholds), BEGINS_DRIVEN
        elif motion.creeps(thresholds):
            known, why = _skip_first_readings(record, period_s, thresholds), BEGINS_SLOWLY
        else:
            known, why = record, ""
        if known.first > record.first:
            begun[why].append(known)
        warm.append(_with_velocity(known, motion, thresholds))
    for why, changed in begun.items():
        if changed:
            first_s = max(record.first * record.period_s for record in changed)
            notes.append(why.format(len(changed), len(records), first_s))
    return _divided(warm, len(screened.fit), notes)


def has_two_wells(simulation: Simulation) -> bool:
    """Return whether the stiffness is negative, so that the motion is between two wells."""
    return any(one.name == "stiffness" and one.value < 0.0 for one in simulation.parameters)


def skip_unknown_history(
    screened: Screened, simulation: Simulation, thresholds: ScreeningThresholds
) -> Screened:
    """Leave unscored what of the records of a plant with memory depends on an unknown history."""
    records = [*screened.fit, *screened.tests]
    values = np.array([one.value for one in simulation.parameters])
    histories = [_visible_history(record, simulation, values, thresholds) for record in records]
    known = [
        replace(record, first=max(record.first, history.samples))
        for record, history in zip(records, histories, strict=True)
    ]
    changed = [new for new, old in zip(known, records, strict=True) if new.first > old.first]
    notes = []
    if changed:
        names = ", ".join(dict.fromkeys(one.name for one in changed))
        words = f"record {names} does" if len(changed) == 1 else f"records {names} do"
        first_s = max(one.first * one.period_s for one in changed)
        notes.append(UNKNOWN_HISTORY.format(words, max(one.offset for one in histories), first_s))
    return _divided(known, len(screened.fit), notes)


def _divided(records: Sequence[FitRecord], to_fit: int, notes: Sequence[str]) -> Screened:
    """Return the first `to_fit` records as those to fit, and the others as those to test on."""
    return Screened(tuple(records[:to_fit]), tuple(records[to_fit:]), tuple(notes))


def _visible_history(
    record: FitRecord, simulation: Simulation, values: FloatArray, thresholds: ScreeningThresholds
) -> _History:
    """Compare a run from a full cooling with a record: how long does it miss more than usual, where it is scored?"""
    first = thresholds.history_first_samples
    scored = record.samples - record.first
    block = max(first, scored // thresholds.history_blocks)
    count = scored // block
    samples, worst = 0, 0.0
    try:
        run = simulation.predict(record.stimulus, values)
    except ValueError:  # the check of the speed, or the fit, reports it
        return _History()
    for name in (one for one in simulation.outputs if one in record.measured):
        missed = (run.outputs[name][0] - record.measured[name])[record.first :]
        error = np.nan_to_num(missed, posinf=0.0, neginf=0.0)
        rms = np.sqrt(np.mean(error[: count * block].reshape(count, block) ** 2, axis=1))
        usual, size = float(np.median(rms)), float(record.measured[name].std())
        offset = abs(float(error[:first].mean()))
        if not offset > max(thresholds.history_offset_ratio * usual, thresholds.history_offset * size):
            continue
        good = rms < thresholds.history_usual_ratio * usual
        over = np.flatnonzero(good[:-1] & good[1:])
        if len(over) and over[0] <= count // 2:
            samples = max(samples, record.first + int(over[0]) * block)
            worst = max(worst, offset / size)
    return _History(samples, worst)


def _initial_motion(record: FitRecord, rate: float, thresholds: ScreeningThresholds) -> _InitialMotion:
    """Estimate the motion at the first sample by a cubic through the first readings; `rate` [1/s] of the motion."""
    measured, fewest = record.measured.get("displacement"), thresholds.start_fit_samples
    size = float(measured.std()) if measured is not None and record.samples > fewest else 0.0
    if measured is None or size == 0.0:
        return _InitialMotion()
    noise = float(np.median(np.abs(np.diff(measured, 4)))) / NOISE_OF_DIFFERENCES / size
    span_s = 2.0 * np.pi * thresholds.start_fit_periods / rate
    most = min(record.samples, round(span_s / record.period_s))
    count, solution = fewest, _cubic_fit(fewest, rate * record.period_s)
    while count < most and noise * float(np.linalg.norm(solution[1])) > thresholds.start_velocity_error:
        count = min(2 * count, most)
        solution = _cubic_fit(count, rate * record.period_s)
    displacement, velocity = solution @ (measured[:count] - measured.mean()) / size
    return _InitialMotion(
        displacement=abs(displacement),
        velocity=abs(velocity),
        error=noise * float(np.linalg.norm(solution[1])),
        units_per_s=float(velocity) * size * rate,
        declared="displacement" in record.stimulus.initial.keys() - record.stimulus.read,
    )


def _cubic_fit(count: int, step: float) -> FloatArray:
    """Return the (2, count) matrix that gives value and slope at the first of `count` readings `step` apart."""
    basis = np.vander(step * np.arange(count), 4, increasing=True)
    solution: FloatArray = np.linalg.pinv(basis)[:2]
    return solution


def _warm_up(
    record: FitRecord, period_s: float, thresholds: ScreeningThresholds, two_wells: bool
) -> FitRecord:
    """Return `record` with its first periods [s] unscored."""
    periods = thresholds.warm_up_periods_two_wells if two_wells else thresholds.warm_up_periods
    least, most = (round(count * period_s / record.period_s) for count in periods)
    samples = int(np.clip(thresholds.warm_up_share * record.samples, least, most))
    samples = min(samples, int(thresholds.warm_up_max_share * record.samples))
    return replace(record, first=max(record.first, samples))


def _is_driven_at_first(record: FitRecord, thresholds: ScreeningThresholds) -> bool:
    """Return whether a drive was at work when the record began: one that acts late is still the unknown one before."""
    drives = record.stimulus.inputs.values()
    return any(abs(drive[0]) > thresholds.sudden_drive * float(drive.std()) > 0.0 for drive in drives)


def _skip_first_readings(record: FitRecord, period_s: float, thresholds: ScreeningThresholds) -> FitRecord:
    """Return `record` without the readings of its first half of a period [s]."""
    samples = int(thresholds.sudden_periods * period_s / record.period_s)
    samples = min(samples, int(thresholds.sudden_max_share * record.samples))
    return replace(record, first=max(record.first, samples))


def _with_velocity(record: FitRecord, motion: _InitialMotion, thresholds: ScreeningThresholds) -> FitRecord:
    """Return `record` with its estimated initial velocity, unless the manifest gives one or it hardly moves."""
    if not (record.first and motion.moves(thresholds)) or "velocity" in record.stimulus.initial:
        return record
    initial = {**record.stimulus.initial, "velocity": motion.units_per_s}
    return replace(record, stimulus=replace(record.stimulus, initial=initial))
