"""Readings that no motion makes, one or two samples far from all others: a fit of squares would follow nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record

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
    "{} {} readings are spikes ({}), the largest {:.4g} {} in sample {} of {}: replaced by the line between their "
    "neighbours; what made them cannot be diagnosed"
)


class _Spike(NamedTuple):
    """The largest of a record."""

    many: int
    value: float
    sample: int
    record: str


def without_spikes(
    records: Sequence[Record], names: Sequence[str], units: Mapping[str, str]
) -> tuple[list[Record], list[str]]:
    """The same where there are none, and what is to be said."""
    cleaned, said = list(records), []
    for name in names:
        found = []
        for k, record in enumerate(cleaned):
            at = spikes_in(record.signals[name]) if record.has(name) else ()
            if not len(at):
                continue
            values = record.signals[name]
            largest = int(at[np.argmax(np.abs(values[at]))])
            found.append(_Spike(len(at), float(values[largest]), largest, record.name))
            rest = np.delete(np.arange(len(values)), at)
            mended = np.interp(np.arange(len(values)), rest, values[rest])
            cleaned[k] = replace(record, signals=dict(record.signals) | {name: mended})
        if found:
            top = max(found, key=lambda one: abs(one.value))
            where = ", ".join(f"{one.many} in {one.record}" for one in found)
            total = sum(one.many for one in found)
            said.append(
                SPIKES.format(total, name, where, top.value, units.get(name, ""), top.sample, top.record)
            )
    return cleaned, said


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
