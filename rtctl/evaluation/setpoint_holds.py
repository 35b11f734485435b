"""Setpoint holds of a run: the settled output of each, and how long it took to settle."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.records import DeviceProfile

Predict = Callable[[Mapping[str, float]], dict[str, float]]

SETTLED_PERCENT = 1.0
"""Largest distance of a settled output from its setpoint [%]."""


class Hold(NamedTuple):
    """A held setpoint: rows `first` to before `end` of the recording, settled from row `settled` on."""

    first: int
    settled: int
    end: int


def holds_of(index: FloatArray, setpoint: FloatArray, period_s: float, settle_s: float) -> list[Hold]:
    """Return every stretch of one setpoint.

    Args:
        index: periods since the start of each row (n,), missed ones included.
        setpoint: setpoint of each row (n,).
        period_s: sample period [s].
        settle_s: time after which a hold counts as settled [s].
    """
    changes = np.flatnonzero(np.diff(setpoint)) + 1
    edges = [0, *changes.tolist(), len(setpoint)]
    holds = []
    for first, end in zip(edges[:-1], edges[1:], strict=True):
        after = index[first] + math.ceil(settle_s / period_s - 1e-9)
        settled = first + int(np.searchsorted(index[first:end], after))
        holds.append(Hold(first, settled, end))
    return holds


def hold_error_percent(setpoint: FloatArray, output: FloatArray, holds: list[Hold]) -> float | None:
    """Return the largest |output - setpoint| of settled samples in percent of the setpoint; None if there is none."""
    parts = [relative_error(setpoint[h.settled : h.end], output[h.settled : h.end]) for h in holds]
    errors = np.concatenate(parts) if parts else np.empty(0)
    return float(errors.max()) if len(errors) else None


def relative_error(setpoint: FloatArray, output: FloatArray) -> FloatArray:
    """Return |output - setpoint| in percent of setpoints > 0, where there is an output."""
    scored = (setpoint > 0.0) & np.isfinite(output)
    return 100.0 * np.abs(output[scored] - setpoint[scored]) / setpoint[scored]


def settling_ms(
    index: FloatArray, setpoint: FloatArray, output: FloatArray, period_s: float, holds: list[Hold]
) -> float | None:
    """Return the longest time [ms] that the output took to stay within `SETTLED_PERCENT` of a new setpoint.

    Args:
        index: periods since the start of each row (n,), missed ones included.
        setpoint: setpoint of each row (n,).
        output: output of each row (n,), in the setpoint's unit.
        period_s: sample period [s].
        holds: the holds of `setpoint`.

    Returns:
        None if there is no hold with a setpoint > 0 and an output.
    """
    times = []
    for hold in holds:
        wanted, got = setpoint[hold.first : hold.end], output[hold.first : hold.end]
        if not (wanted[0] > 0.0 and np.isfinite(got).all()):
            continue
        outside = np.flatnonzero(relative_error(wanted, got) > SETTLED_PERCENT)
        last = index[hold.first + outside[-1]] + 1.0 if len(outside) else index[hold.first]
        times.append(1e3 * period_s * (last - index[hold.first]))
    return max(times) if times else None


def level_rows(
    signals: Mapping[str, FloatArray], profile: DeviceProfile, holds: list[Hold], predict: Predict
) -> list[dict[str, float]]:
    """Return means over the settled part of every hold, `name_unit` as keys, and what the model predicts for them.

    Args:
        signals: recorded signals (n,) by name.
        profile: names and units of the device's channels.
        holds: the holds of the setpoint.
        predict: maps the means of the channels to the model's predictions.
    """
    channels = (profile.reference, *profile.commands)
    rows = []
    for hold in holds:
        if hold.settled >= hold.end:
            continue
        part = slice(hold.settled, hold.end)
        means = {channel.name: float(signals[channel.name][part].mean()) for channel in channels}
        row = {f"setpoint_{profile.reference.unit}": float(signals["setpoint"][hold.first])}
        row |= {f"{channel.name}_{channel.unit}": means[channel.name] for channel in channels}
        rows.append(row | predict(means))
    return rows
