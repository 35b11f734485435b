"""Repeatability: how much a signal differs between repeats of one input, the limit of any model's error.

Of m repeats y_i, the noise's variance at each sample is sum (y_i - mean)^2 / (m - 1). Records are read one at a time.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record
from rtctl.measured.stored import StoredDataset


def noise_floors(dataset: StoredDataset) -> dict[str, dict[str, float]]:
    """Return the RMS [its unit] that does not repeat, by letter of `repeat` and output."""
    letters = Counter(head.repeat for head in dataset.heads if head.repeat is not None)
    return {letter: _floor(dataset, letter) for letter, count in letters.items() if count > 1}


def deviation(dataset: StoredDataset, record: Record, output: str) -> FloatArray | None:
    """Return the part of `record` (n,) that does not repeat, with the noise's own variance; None without repeats."""
    total, count = np.zeros(record.samples), 0
    for k, head in enumerate(dataset.heads):
        if record.repeat is not None and head.repeat == record.repeat:
            values = dataset.read(k).signals.get(output)
            if values is not None and len(values) >= record.samples:
                total, count = total + values[: record.samples], count + 1
    if count < 2:
        return None
    scatter: FloatArray = (record.signals[output] - total / count) * np.sqrt(count / (count - 1.0))
    return scatter


def _floor(dataset: StoredDataset, letter: str) -> dict[str, float]:
    """Accumulate by Welford's recurrence over the repeats, cut to the shortest so far."""
    mean: dict[str, FloatArray] = {}
    squares: dict[str, FloatArray] = {}
    seen: Counter[str] = Counter()
    first = 0
    for k, head in enumerate(dataset.heads):
        if head.repeat != letter:
            continue
        record = dataset.read(k)
        first = max(first, record.ignore_first)
        outputs = {name: values for name, values in record.signals.items() if name not in dataset.holds}
        for name, values in outputs.items():
            _add(mean, squares, seen, name, values)
    return {name: _rms(squares[name][first:], count) for name, count in seen.items() if count > 1}


def _add(
    mean: dict[str, FloatArray],
    squares: dict[str, FloatArray],
    seen: Counter[str],
    name: str,
    values: FloatArray,
) -> None:
    length = min(len(values), len(mean.get(name, values)))
    values = values[:length]
    before, spread = mean.get(name, np.zeros(length))[:length], squares.get(name, np.zeros(length))[:length]
    seen[name] += 1
    mean[name] = before + (values - before) / seen[name]
    squares[name] = spread + (values - before) * (values - mean[name])


def _rms(squares: FloatArray, count: int) -> float:
    return float(np.sqrt(np.mean(squares) / (count - 1))) if len(squares) else float("nan")
