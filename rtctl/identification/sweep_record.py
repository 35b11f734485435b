"""A sweep as the fits take it: without the rows beside a jump, and with the branch that each row is on.

Where a response folds, a device leaves its branch at a frequency that noise and the sweep's speed decide too, and close
to the fold any small parameter changes the response much: the rows there tell little of a model, and are left out of
fits (`rtctl simulate` scores them). In every other row a simulation is on the branch that was measured.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import ComplexArray
from rtctl.identification.fit_record import FitRecord, response_of
from rtctl.measured.dataset import FREQUENCY, paired

JUMP_RATIO = 3.0
"""Step of the complex amplitude, over the larger one of the steps before and after it, above which it is a jump."""
JUMP_SHARE = 0.1
"""Step over the largest amplitude of the sweep below which there is no jump."""
ROWS_BEFORE, ROWS_AFTER = 2, 1
"""Rows before and after a jump that are left out."""


def find_jumps(amplitudes: ComplexArray) -> NDArray[np.intp]:
    """Return the rows from which complex amplitudes (n,) jump to the next row.

    A row that was read while the motion fell from one branch to the other makes two jumps of one.
    """
    steps = np.abs(np.diff(amplitudes))
    before, after = np.pad(steps, (2, 0))[:-2], np.pad(steps, (0, 2))[2:]
    last, next_ = np.pad(steps, (1, 0))[:-1], np.pad(steps, (0, 1))[1:]
    beside = np.minimum.reduce([np.maximum(last, next_), np.maximum(last, after), np.maximum(before, next_)])
    found = (steps > JUMP_RATIO * beside) & (steps > JUMP_SHARE * np.abs(amplitudes).max())
    return np.flatnonzero(found)


def shorten(record: FitRecord, samples: int) -> FitRecord:
    """Return a record with at most `samples` of its samples: the first ones; of a sweep rows from the whole of it.

    The first rows of a sweep are far from its resonance, and tell nothing of it.
    """
    if samples >= record.samples:
        return record
    if FREQUENCY not in record.stimulus.inputs:
        return record.truncate(samples)
    rows = choose_rows(paired(record.measured[response_of([record])]), samples // 2)
    chosen = (2 * rows[:, None] + np.arange(2)).reshape(-1)
    whole = record.stimulus
    stimulus = replace(
        whole,
        inputs={name: values[chosen] for name, values in whole.inputs.items()},
        guide={name: values[chosen] for name, values in whole.guide.items()},
        count=len(chosen),
    )
    return replace(record, stimulus=stimulus, measured={k: one[chosen] for k, one in record.measured.items()})


def choose_rows(amplitudes: ComplexArray, count: int) -> NDArray[np.intp]:
    """Return about `count` rows of complex amplitudes (n,): half of them evenly, half by how far these move."""
    moved = np.append(0.0, np.cumsum(np.abs(np.diff(amplitudes))))
    evenly = np.linspace(0.0, 1.0, len(amplitudes))
    way = 0.5 * (evenly + (moved / moved[-1] if moved[-1] > 0.0 else evenly))
    order = np.searchsorted(way, np.linspace(0.0, 1.0, max(count, 1))).clip(0, len(amplitudes) - 1)
    return np.unique(order)


def prepare_sweep(record: FitRecord) -> FitRecord:
    """Return a sweep without the rows beside its jumps, guided by what was measured; a record in time unchanged."""
    whole = record.stimulus
    if FREQUENCY not in whole.inputs:
        return record
    output = response_of([record])
    amplitudes = paired(record.measured[output])
    kept = np.ones(len(amplitudes), dtype=bool)
    for row in find_jumps(amplitudes):
        kept[max(row - ROWS_BEFORE + 1, 0) : row + 1 + ROWS_AFTER] = False
    samples = np.repeat(kept, 2)
    measured = {name: values[samples] for name, values in record.measured.items()}
    inputs = {name: values[samples] for name, values in whole.inputs.items()}
    stimulus = replace(whole, inputs=inputs, count=int(samples.sum()), guide=measured)
    return replace(record, stimulus=stimulus, measured=measured)
