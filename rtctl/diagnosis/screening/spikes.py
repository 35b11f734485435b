"""Spikes: one or two readings far from all others, which no motion makes and which would dominate a sum of squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

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
            at = find_spikes(record.signals[output], thresholds) if record.has(output) else ()
            if not len(at):
                continue
            values = record.signals[output]
            largest = int(at[np.argmax(np.abs(values[at]))])
            found.append(_Spikes(len(at), float(values[largest]), largest, record.name))
            others = np.delete(np.arange(len(values)), at)
            mended = np.interp(np.arange(len(values)), others, values[others])
            cleaned[k] = replace(record, signals=dict(record.signals) | {output: mended})
        if found:
            notes.append(_note_of(found, output, units.get(output, "")))
    return Kept(cleaned, notes)


def _note_of(found: Sequence[_Spikes], output: str, unit: str) -> str:
    """Return the note on the spikes of one output."""
    top = max(found, key=lambda one: abs(one.largest))
    where = ", ".join(f"{one.samples} in {one.record}" for one in found)
    total = sum(one.samples for one in found)
    return SPIKES.format(total, output, where, top.largest, unit, top.sample, top.record)


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
