"""Checks of single records before any fit: too short, motionless, repeats of other inputs, impossible readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.screening.screened import Kept
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.measured.dataset import Record
from rtctl.output.readable_units import readable

SEEN, LEAST_LINES, ALIKE = 0.01, 4, 0.5
"""Share of the largest line of a cross-spectrum from which on a line counts, the lines that are needed, and the mean
cosine of their phases, least."""


def drop_short_records(records: Sequence[Record], thresholds: ScreeningThresholds) -> Kept:
    """Drop the records with too few scored samples; a sweep has two for each row."""
    swept = any(record.is_sweep for record in records)
    least = 2 * thresholds.min_sweep_rows if swept else thresholds.min_samples
    usable = [record for record in records if record.samples - record.ignore_first >= least]
    return Kept(
        usable,
        [
            f"record {record.name} has {record.samples - record.ignore_first} scored samples, fewer than "
            f"{least}, and was left out"
            for record in records
            if record not in usable
        ],
    )


def drop_constant_records(records: Sequence[Record], signal: str) -> Kept:
    """Drop the records without `signal`, or in which it is one constant number."""
    usable, notes = list[Record](), list[str]()
    for record in records:
        if not record.has(signal):
            notes.append(f"record {record.name} has no {signal} and was left out")
        elif np.ptp(record.signals[signal][record.ignore_first :]) == 0.0:
            notes.append(f"record {record.name}: the {signal} is one constant number; it was left out")
        else:
            usable.append(record)
    return Kept(usable, notes)


def unmark_false_repeats(records: Sequence[Record], drive: str, thresholds: ScreeningThresholds) -> Kept:
    """Remove the `repeat` mark of records whose inputs differ from those of the records with the same mark."""
    wrong, notes = set(), []
    for letter in dict.fromkeys(record.repeat for record in records if record.repeat is not None):
        group = [record for record in records if record.repeat == letter]
        samples = min(record.samples for record in group)
        drives = np.stack([record.signals[drive][:samples] for record in group])
        size = float(np.sqrt(np.mean(drives**2)))
        difference = float(np.sqrt(np.mean((drives - drives[0]) ** 2, axis=1)).max())
        if difference > thresholds.repeat_tolerance * size:
            wrong.add(letter)
            notes.append(
                f'records {", ".join(one.name for one in group)} have repeat = "{letter}", but their {drive}s differ '
                f"by up to {difference / size:.0%} (RMS): they are no repeats of one input, and were not used as such"
            )
    return Kept([replace(one, repeat=None) if one.repeat in wrong else one for one in records], notes)


def note_impossible_readings(records: Sequence[Record], units: Mapping[str, str]) -> Kept:
    """Note the resistances that are not above zero."""
    counts = {
        r.name: int(np.count_nonzero(r.signals["resistance"] <= 0.0)) for r in records if r.has("resistance")
    }
    names = [name for name, count in counts.items() if count]
    if not names:
        return Kept(records, [])
    note = (
        f"{', '.join(names)}: {sum(counts.values())} readings of the resistance are 0 {units['resistance']} or less, "
        "which no film has: are its column, unit and sign right, was the reader in range?"
    )
    return Kept(records, [note])


def note_inconsistent_velocities(records: Sequence[Record], thresholds: ScreeningThresholds) -> Kept:
    """Note velocities that are not the slope of the displacement beside them.

    The slope is compared by Frisch's bounds, which hold for any division of the noise between the two readings.
    """
    ratios: dict[str, float] = {}
    for record in (one for one in records if one.has("velocity") and one.has("displacement")):
        slope = np.gradient(record.signals["displacement"], record.period_s)
        velocity = record.signals["velocity"] - record.signals["velocity"].mean()
        sizes = float(slope.std()), float(velocity.std())
        correlation = float(np.mean((slope - slope.mean()) * velocity)) / max(sizes[0] * sizes[1], 1e-300)
        standard_error = np.sqrt(thresholds.samples_per_independent / record.samples)
        if abs(correlation) < thresholds.velocity_correlation_errors * standard_error:
            continue  # the motion is not visible in one of them
        low, high = (sizes[0] / sizes[1] * factor for factor in (abs(correlation), 1.0 / abs(correlation)))
        tolerance = thresholds.velocity_slope_tolerance
        if correlation < 0.0 or low > 1.0 + tolerance or high < 1.0 - tolerance:
            ratios[record.name] = float(np.copysign(sizes[0] / sizes[1], correlation))
    if not ratios:
        return Kept(records, [])
    note = (
        f"{', '.join(ratios)}: the displacement's slope is {next(iter(ratios.values())):.3g} times the velocity that "
        "was read beside it: are the velocity's unit, sign and column right, and are both of one motion?"
    )
    return Kept(records, [note])


def note_late_velocities(records: Sequence[Record], thresholds: ScreeningThresholds) -> Kept:
    """Note velocities that come earlier or later than the slope of the displacement beside them."""
    late = {}
    for record in (one for one in records if one.has("velocity") and one.has("displacement")):
        late_s, error_s = _delay_of(record)
        if abs(late_s) > max(
            thresholds.late_velocity_periods * record.period_s, thresholds.late_velocity_errors * error_s
        ):
            late[record.name] = late_s
    delays = np.array(list(late.values()))
    if not late or len(np.unique(np.sign(delays))) > 1:
        return Kept(records, [])
    mean_s, way = float(np.abs(delays).mean()), "later" if delays[0] > 0.0 else "earlier"
    note = (
        f"{', '.join(late)}: the velocity comes {readable(mean_s, 's')} {way} than the slope of the displacement that "
        "was read beside it, and both are taken for one motion: causes that are told may stand for that alone. Is one "
        "of them behind a filter, or late by itself? Align them, or leave one out"
    )
    return Kept(records, [note])


def _delay_of(record: Record) -> tuple[float, float]:
    """Return by how much the velocity is later than the displacement's slope [s], with its standard error.

    By the phase of their cross-spectrum over frequency, where both are large.
    """
    window = np.hanning(record.samples)
    slope = np.gradient(record.signals["displacement"], record.period_s)
    velocity = record.signals["velocity"]
    first, second = (np.fft.rfft(window * (one - one.mean())) for one in (slope, velocity))
    across = second * np.conj(first)
    rates = 2.0 * np.pi * np.fft.rfftfreq(record.samples, record.period_s)
    seen = np.abs(across) > SEEN * np.abs(across).max()
    weight, rates, phase = np.abs(across[seen]), rates[seen], np.angle(across[seen])
    size = float(np.sum(weight * rates**2))
    alike = float(weight @ np.cos(phase)) > ALIKE * float(weight.sum())  # not of another sign
    if not (size > 0.0 and alike) or len(rates) < LEAST_LINES:
        return 0.0, np.inf
    late_s = -float(np.sum(weight * rates * phase)) / size
    left = phase + rates * late_s
    error_s = np.sqrt(float(np.sum(weight**2 * rates**2 * left**2))) / size
    return late_s, float(error_s)
