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
    edges = np.concatenate(([0], np.flatnonzero(np.diff(setpoint)) + 1, [len(setpoint)]))
    first, end = edges[:-1], edges[1:]
    after = index[first] + math.ceil(settle_s / period_s - 1e-9)
    settled = np.clip(np.searchsorted(index, after), first, end)
    return [Hold(*one) for one in zip(first.tolist(), settled.tolist(), end.tolist(), strict=True)]


def hold_error_percent(setpoint: FloatArray, output: FloatArray, holds: list[Hold]) -> float | None:
    """Return the largest |output - setpoint| of settled samples in percent of the setpoint; None if there is none."""
    edges = np.zeros(len(setpoint) + 1)
    np.add.at(edges, [one.settled for one in holds], 1.0)
    np.add.at(edges, [one.end for one in holds], -1.0)
    settled = np.cumsum(edges[:-1]) > 0.0
    errors = relative_error(setpoint[settled], output[settled])
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
    first = np.array([hold.first for hold in holds])
    scored = (setpoint[first] > 0.0) & np.logical_and.reduceat(np.isfinite(output), first)
    with np.errstate(divide="ignore", invalid="ignore"):
        outside = 100.0 * np.abs(output - setpoint) / setpoint > SETTLED_PERCENT
    last = np.maximum.reduceat(np.where(outside, np.arange(len(setpoint)), -1), first)
    periods = np.where(last < 0, 0.0, index[last] + 1.0 - index[first])[scored]
    return float(1e3 * period_s * periods.max()) if len(periods) else None


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
