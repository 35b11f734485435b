"""Spikes: one or two readings far from all others, which no motion makes and which would dominate a sum of squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import coherence, welch

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.screening.screened import Kept
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.measured.dataset import Record

# Standard deviation over the median absolute deviation of a normal distribution.
NORMAL_MAD = 1.4826
SPIKES = (
    "{} {} readings are spikes ({}), the largest {:.4g} {} in sample {} of {}: they were replaced by the line between "
    "their neighbours; what made them cannot be diagnosed"
)


MISREAD_DRIVE = (
    "{} readings of the {} are spikes ({}), the largest {:.4g} {} in sample {} of {}, and the response does not follow "
    "them: they were taken as misread, and replaced by the line between their neighbours"
)
UNSURE_DRIVE = (
    "{} readings of the {} are spikes ({}), the largest {:.4g} {} in sample {} of {}; the response does not "
    "show if the device felt them, so they were kept: if they were misread, the answer is about them"
)


class _Spikes(NamedTuple):
    """The spikes of one record."""

    samples: int
    largest: float
    sample: int
    """Index of the largest one."""
    record: str


def replace_spikes(
    records: Sequence[Record],
    outputs: Sequence[str],
    units: Mapping[str, str],
    thresholds: ScreeningThresholds,
) -> Kept:
    """Replace the spikes of the `outputs` by the line between their neighbours."""
    cleaned, notes = list(records), []
    for output in outputs:
        found = []
        for k, record in enumerate(cleaned):
            if not record.has(output):
                continue
            at = find_spikes(record.signals[output], thresholds)
            if not len(at):
                continue
            found.append(_spikes(record, output, at))
            mended = without(record.signals[output], at)
            cleaned[k] = replace(record, signals=dict(record.signals) | {output: mended})
        if found:
            notes.append(_note_of(found, output, units.get(output, "")))
    return Kept(cleaned, notes)


def replace_drive_spikes(
    records: Sequence[Record],
    drive: str,
    output: str,
    units: Mapping[str, str],
    thresholds: ScreeningThresholds,
) -> Kept:
    """Replace the spikes of the `drive` that the `output` does not follow: they were read and not sent."""
    cleaned = list(records)
    misread: list[_Spikes] = []
    unsure: list[_Spikes] = []
    for k, record in enumerate(cleaned):
        if record.is_sweep or not record.has(output) or not record.has(drive):
            continue
        values, response = record.signals[drive], record.signals[output]
        at = find_spikes(values, thresholds)
        if not len(at) or not np.ptp(mended := without(values, at)) > 0.0:
            continue
        raw, better = (unexplained_share(one, response, thresholds) for one in (values, mended))
        if better < thresholds.spike_misread * raw:
            misread.append(_spikes(record, drive, at))
            cleaned[k] = replace(record, signals=dict(record.signals) | {drive: mended})
        elif better < thresholds.spike_followed * raw:
            unsure.append(_spikes(record, drive, at))
    told = ((misread, MISREAD_DRIVE), (unsure, UNSURE_DRIVE))
    return Kept(
        cleaned, [_note_of(found, drive, units.get(drive, ""), text) for found, text in told if found]
    )


def unexplained_share(drive: FloatArray, response: FloatArray, thresholds: ScreeningThresholds) -> float:
    """Return the share of the response's (n,) power that no linear law makes of the drive (n,).

    It is one minus the coherence, weighted by the power of the response over frequency (Bendat and Piersol, Random
    Data, section 6.1).
    """
    length = max(len(drive) // thresholds.spike_segments, thresholds.spike_median_width + 1)
    _, coherent = coherence(drive, response, nperseg=length)
    _, power = welch(response, nperseg=length)
    total = float(power.sum())
    return float(((1.0 - np.nan_to_num(coherent)) * power).sum()) / total if total > 0.0 else 1.0


def without(values: FloatArray, at: NDArray[np.intp]) -> FloatArray:
    """Return `values` (n,) with the line between their neighbours in place of those at `at`."""
    others = np.delete(np.arange(len(values)), at)
    mended: FloatArray = np.interp(np.arange(len(values)), others, values[others])
    return mended


def _spikes(record: Record, signal: str, at: NDArray[np.intp]) -> _Spikes:
    values = record.signals[signal]
    largest = int(at[np.argmax(np.abs(values[at]))])
    return _Spikes(len(at), float(values[largest]), largest, record.name)


def _note_of(found: Sequence[_Spikes], signal: str, unit: str, text: str = SPIKES) -> str:
    """Return the note on the spikes of one signal."""
    top = max(found, key=lambda one: abs(one.largest))
    where = ", ".join(f"{one.samples} in {one.record}" for one in found)
    total = sum(one.samples for one in found)
    return text.format(total, signal, where, top.largest, unit, top.sample, top.record)


def find_spikes(values: FloatArray, thresholds: ScreeningThresholds | None = None) -> NDArray[np.intp]:
    """Return the indices of the spikes in `values` (n,); none where so many are no exception.

    First or last readings are none if they may belong to a decay, such as that of a warm-up: then the step after theirs
    is not much smaller.
    """
    thresholds = thresholds or ScreeningThresholds()
    none = np.empty(0, dtype=np.intp)
    if len(values) <= thresholds.spike_median_width:
        return none
    distance = np.abs(values - median_filter(values, thresholds.spike_median_width, mode="mirror"))
    usual = NORMAL_MAD * float(np.median(distance))
    usual = usual or NORMAL_MAD * float(np.median(np.abs(np.diff(values))))
    reach = float(np.quantile(np.abs(values - np.median(values)), 0.99))
    far = distance > max(thresholds.spike_distance * usual, thresholds.spike_reach * reach)
    at = np.flatnonzero(far)
    if not 0 < len(at) <= thresholds.spike_max_share * len(values):
        return none
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    short = [run for run in runs if len(run) <= thresholds.spike_max_samples]
    return np.concatenate(
        [none, *(run for run in short if not _is_decay(values, run, thresholds.spike_edge_ratio))]
    )


def _is_decay(values: FloatArray, run: NDArray[np.intp], ratio: float) -> bool:
    """Return whether a run at the first or last reading may belong to a decay: its step is no lone one."""
    if run[0] != 0 and run[-1] != len(values) - 1:
        return False
    edge = values[: len(run) + 2] if run[0] == 0 else values[: -len(run) - 3 : -1]
    steps = np.abs(np.diff(edge))
    return bool(steps[-2] < ratio * steps[-1])
