"""Readings that no motion makes, one or two samples far from all others: a fit of squares would follow nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from rtctl.measured.dataset import Record

FloatArray = NDArray[np.float64]
WIDE = 7
"""Samples of the running median: it follows a step, and up to three samples beside one another are nothing to it."""
LONGEST = 2
"""Samples of a spike; a longer one may be a motion."""
FAR = 30.0
"""Times as far from the running median as the readings are (median)."""
BEYOND = 2.0
"""Times as far from it as 99 % of the readings are from their median."""
MOST = 0.01
"""Of a record; where there are more of them, that is how the device is."""
NORMAL_MAD = 1.4826
SPIKES = (
    "record {}: {} of its {} readings are spikes, the largest {:.4g} {} in sample {}: replaced by the line between "
    "their neighbours; what made them cannot be diagnosed"
)


def without_spikes(
    record: Record, names: Sequence[str], units: Mapping[str, str]
) -> tuple[Record, list[str]]:
    """The same where there are none, and what is to be said."""
    signals, said = dict(record.signals), []
    for name in (one for one in names if record.has(one)):
        values = record.signals[name]
        at = spikes_in(values)
        if len(at):
            largest = int(at[np.argmax(np.abs(values[at]))])
            said.append(
                SPIKES.format(record.name, len(at), name, values[largest], units.get(name, ""), largest)
            )
            rest = np.delete(np.arange(len(values)), at)
            signals[name] = np.interp(np.arange(len(values)), rest, values[rest])
    return (replace(record, signals=signals) if said else record), said


def spikes_in(values: FloatArray) -> NDArray[np.intp]:
    """Their samples."""
    none = np.empty(0, dtype=np.intp)
    if len(values) <= WIDE:
        return none
    away = np.abs(values - median_filter(values, WIDE, mode="mirror"))
    usual = NORMAL_MAD * float(np.median(away))
    usual = usual or NORMAL_MAD * float(np.median(np.abs(np.diff(values))))
    reach = float(np.quantile(np.abs(values - np.median(values)), 0.99))
    far = away > max(FAR * usual, BEYOND * reach)
    at = np.flatnonzero(far)
    if not 0 < len(at) <= MOST * len(values):
        return none
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    return np.concatenate([none, *(run for run in runs if len(run) <= LONGEST)])
