"""Checks of what the records excite and what the sensor hides: clipping, a constant drive, a single tone, length."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.clipping import find_cut_off
from rtctl.measured.dataset import Record


class _Pile(NamedTuple):
    """Readings of one record at its largest or smallest value."""

    record: str
    readings: int


class _Tone(NamedTuple):
    """A drive that is a single line."""

    frequency_hz: float
    level: float
    """RMS about the mean, in the drive's unit."""


def note_clipping(
    records: Sequence[Record], output: str, unit: str, thresholds: ScreeningThresholds
) -> list[str]:
    """Note readings that pile up at exactly the largest or smallest value, once for each such value.

    A motion that comes to rest there is none that was cut off.
    """
    piles: dict[tuple[str, float], list[_Pile]] = {}
    for record, (side, sign) in product(records, (("largest", 1.0), ("smallest", -1.0))):
        values = sign * record.signals[output]
        levels, counts = np.unique(values, return_counts=True)
        beside = counts[-4:-1].max() if len(counts) > 1 else 0
        least = max(
            thresholds.min_clipped_readings,
            thresholds.clipped_share * record.samples,
            thresholds.clipped_pile_ratio * beside,
        )
        if len(levels) > thresholds.min_levels and counts[-1] >= least:
            cut = sum(int(np.count_nonzero(values[a:b] == levels[-1])) for a, b in find_cut_off(values))
            if cut >= least:
                piles.setdefault((side, sign * float(levels[-1])), []).append(_Pile(record.name, cut))
    return [
        f"{'record' if len(found) == 1 else 'records'} {', '.join(one.record for one in found)}: "
        f"{sum(one.readings for one in found)} readings are exactly the {side} value, {value:.5g} {unit}: the sensor "
        "is clipped; what it hid cannot be diagnosed, and the clipping itself may be named as sensor.saturation"
        for (side, value), found in piles.items()
    ]


def note_standing_readings(
    records: Sequence[Record], output: str, unit: str, thresholds: ScreeningThresholds
) -> list[str]:
    """Note readings that stand at one value amid a motion whose readings hardly ever do: a sensor that fell out.

    A mass that sticks comes to rest and leaves it slowly; here a step at an end of the run is as large as those of the
    motion. What stands at an end of a record may be a device at rest, and at the largest value a sensor that clips.
    """
    notes = []
    for record in records:
        values = record.signals[output]
        steps = np.abs(np.diff(values))
        alike = steps == 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[False], alike, [False]]).astype(np.int8)))
        first, end = edges[::2], edges[1::2]  # rows first to end have one value
        outer = np.concatenate([[0.0], steps, [0.0]])
        jump = np.maximum(outer[first], outer[end + 1])
        elsewhere = np.count_nonzero(alike) - (end - first)
        amid = (
            (first > 0) & (end < len(steps)) & (values[first] > values.min()) & (values[first] < values.max())
        )
        fell = (
            amid
            & (end - first + 1 >= thresholds.min_standing_readings)
            & (elsewhere <= thresholds.standing_elsewhere * len(steps))
            & (jump > thresholds.standing_jump_ratio * np.median(steps))
        )
        notes += [
            f"record {record.name}: the {output} reads {values[k]:.5g} {unit} in {last - k + 1} rows after each other, "
            f"from {k * record.period_s:.5g} s on, amid a motion: did the sensor fall out? Leave these rows out "
            "(rows = ... in the manifest), since a diagnosis takes them for noise"
            for k, last in zip(first[fell].tolist(), end[fell].tolist(), strict=True)
        ]
    return notes


def note_constant_drive(records: Sequence[Record], drive: str, *, rests: bool) -> list[str]:
    """Note that the drive never changes in any record to fit, and what is seen all the same.

    Args:
        records: Records to fit.
        drive: The input.
        rests: Whether the device does nothing of itself; otherwise it may ring down.
    """
    if not all(np.ptp(record.signals[drive]) == 0.0 for record in records):
        return []
    seen = (
        "what it does, and most causes, are only seen while it changes"
        if rests
        else "what it does (its gain, and causes in its path) is only seen while it changes. A motion that goes on by "
        "itself, as a free decay does, shows the rest: of an oscillator damping, friction and springs"
    )
    return [f"the {drive} of every record to fit is one constant number: {seen}"]


def note_single_tone(records: Sequence[Record], drive: str, thresholds: ScreeningThresholds) -> list[str]:
    """Note that all drives are the same single tone."""
    tones = []
    for record in records:
        signal = record.signals[drive] - record.signals[drive].mean()
        if not signal.any():
            continue
        tone = _tone_of(signal, record.period_s, thresholds)
        if tone is None:
            return []
        tones.append(tone)
    frequencies, levels = (np.array([tone[k] for tone in tones]) for k in (0, 1))
    if (
        not tones
        or np.ptp(frequencies) > thresholds.tone_frequency_spread * frequencies.mean()
        or np.ptp(levels) > thresholds.tone_level_spread * levels.mean()
    ):
        return []
    return [
        f"every fit record is driven by the same tone of {frequencies.mean():.4g} Hz at one level: once it is "
        "steady it shows no more than one complex compliance and its harmonics; what changes with frequency or "
        "amplitude (a delay, a lag, most nonlinear terms) cannot be told apart. Add a sweep or a multisine at two "
        "levels"
    ]


def _tone_of(signal: FloatArray, period_s: float, thresholds: ScreeningThresholds) -> _Tone | None:
    """Return the line that holds nearly all power of `signal` (n,), without its mean; None: it is no tone."""
    power = np.abs(np.fft.rfft(signal * np.hanning(len(signal)))) ** 2
    top, half = int(np.argmax(power)), thresholds.tone_half_width
    line = power[max(0, top - half) : top + half + 1].sum()
    if line < thresholds.tone_power_share * float(power.sum()) or top < thresholds.tone_min_bin:
        return None
    return _Tone(top / (len(signal) * period_s), float(np.std(signal)))


def note_few_periods(records: Sequence[FitRecord], rate: float, thresholds: ScreeningThresholds) -> list[str]:
    """Note that all records together hold only a few periods of the motion, of angular frequency `rate` [1/s]."""
    duration_s = sum((record.samples - record.first) * record.period_s for record in records)
    periods = duration_s * rate / (2.0 * np.pi)
    if periods >= thresholds.min_periods:
        return []
    return [
        f"the fit records hold {periods:.2g} periods of the motion, {duration_s:.3g} s: slow or weak effects and the "
        "damping cannot be told from the initial motion; record longer"
    ]
