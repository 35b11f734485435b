"""Steady states of quasi-static staircases: at the end of each hold the current is the temperature surrogate.

Paper, section II.C: each current is held 10 ms, five time constants of the heating and more. Where a record continues
after it has settled, the steady state is the mean of the settled samples: `count_settled_samples`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.identification.vo2.heating import shows_heating, simulate_read_heating
from rtctl.measured.dataset import Dataset, Record

READINGS = ("resistance", "deflection")
MIN_HOLDS = 10
MAX_SETTLING_RATIO = 0.1
"""Largest squared settling, relative to the variance of a mean's noise, that counts as invisible."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyStates:
    """Means of the settled samples at the ends of holds of one or more staircases in a row.

    Each staircase is preceded by one sample far below the range (`weight` 0): it puts any hysteresis model on the
    branch that a full cooling leaves, which is where each record starts.
    """

    current_mA: FloatArray
    resistance_ohm: FloatArray
    deflection_um: FloatArray
    """NaN where a record has none."""
    weight: FloatArray
    """Weight: 1 for measured samples, 0 for the reset samples and for those the manifest says not to score."""
    reset: NDArray[np.bool_]
    """Which samples precede a staircase (a measured current may be 0 mA as well)."""

    @property
    def scored(self) -> NDArray[np.bool_]:
        """Which samples were measured."""
        return self.weight > 0.0


def find_hold_ends(current_mA: FloatArray) -> NDArray[np.intp]:
    """Return the indices of the last sample of each run of equal current."""
    changes = np.flatnonzero(np.diff(current_mA) != 0.0)
    return np.append(changes, len(current_mA) - 1)


def extract_steady_states(dataset: Dataset, use: str = "identify") -> SteadyStates:
    """Return the steady states of all staircases of a vo2 dataset. Raises InputError where there is none."""
    records = [record for record in dataset.records if record.use == use]
    if not records:
        raise InputError(
            f'{dataset.path}: no record has use = "{use}": a quasi-static staircase is needed, '
            "such as `rtctl acquire` makes"
        )
    return _concatenate([_extract_record_states(record, dataset) for record in records])


def simulate_hold_ends(
    dataset: Dataset, time_constant_s: float, use: str = "identify", *, reads_after: bool = False
) -> FloatArray:
    """Return the surrogate v [mA] at the ends of the holds, in the order of `extract_steady_states`.

    After five time constants 0.7 % of a step is still to come: little, but it would bias the time constant. A
    record with one row a hold gives its steady states themselves.
    """
    parts = []
    for record in dataset.records:
        if record.use == use:
            current = record.signals["current"]
            ends = find_hold_ends(current)
            v = (
                simulate_read_heating(current, record.period_s, time_constant_s, reads_after=reads_after)
                if shows_heating(record)
                else current
            )
            parts += [np.zeros(1), _average_hold_ends(v, ends, count_settled_samples(record))]
    return np.concatenate(parts)


def _extract_record_states(
    record: Record, dataset: Dataset
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    current = record.signals["current"]
    ends = find_hold_ends(current)
    if len(ends) < 20:
        raise InputError(
            f"{dataset.path}: record {record.file or record.name}: only {len(ends)} holds of current; a quasi-static "
            'staircase over the range has hundreds (`rtctl acquire` makes one); give this record use = "fit", or '
            "measure it anew"
        )
    weight = (ends >= record.ignore_first).astype(np.float64)
    count = count_settled_samples(record)
    resistance, deflection = (
        _average_hold_ends(record.signals[name], ends, count)
        if record.has(name)
        else np.full(len(ends), np.nan)
        for name in READINGS
    )
    return current[ends], resistance, deflection, weight


def count_settled_samples(record: Record) -> int:
    """Return how many samples at the end of each hold are averaged: as many as settle by less than the noise shows.

    Of a tail, d is the mean of its newer half less that of its older one, D the step of its mean from the hold before.
    The settling is the share of D that is in d (least squares; stationary noise of any colour has no part in it). The
    rest of d is noise, a quarter of whose variance is that of the mean.
    """
    ends = find_hold_ends(record.signals["current"])
    lengths = np.diff(ends, prepend=-1)
    readings = [record.signals[name] for name in READINGS if record.has(name)]
    most = int(np.median(lengths)) // 4
    for half in range(most, 0, -1):
        held = ends[lengths >= 4 * half, None]
        if all(_is_settled(values, held, half) for values in readings):
            return 2 * half
    return 1


def estimate_unsettled_share(record: Record) -> float:
    """Return the share of a step that the last sample of a hold still adds, for the reading that moves most.

    The step is that of the samples two before the last: they share no noise with the change.

    Returns:
        The share, or NaN where there are too few holds.
    """
    current = record.signals["current"]
    ends = find_hold_ends(current)
    held = ends[np.diff(ends, prepend=-1) >= 4]
    if len(held) < MIN_HOLDS:
        return np.nan
    shares = []
    for values in (record.signals[name] for name in READINGS if record.has(name)):
        change, step = (values[held] - values[held - 1])[1:], np.diff(values[held - 2])
        shares.append(float(change @ step) / max(float(step @ step), 1e-300))
    return max(shares, default=np.nan)


def estimate_static_noise(dataset: Dataset) -> dict[str, float]:
    """Return the RMS noise of one reading, by name (of resistance in its logarithm), about the settled means.

    Empty where no staircase has two settled samples a hold.
    """
    squares: dict[str, list[FloatArray]] = {}
    for record in (one for one in dataset.records if one.use == "identify"):
        count = count_settled_samples(record)
        ends = find_hold_ends(record.signals["current"])
        held = ends[np.diff(ends, prepend=-1) >= count, None] - np.arange(count)
        for name in READINGS:
            if count > 1 and record.has(name):
                values = record.signals[name][held]
                values = np.log(np.maximum(values, 1e-300)) if name == "resistance" else values
                squares.setdefault(name, []).append(values.var(axis=1, ddof=1))
    return {name: float(np.sqrt(np.mean(np.concatenate(found)))) for name, found in squares.items()}


def _is_settled(values: FloatArray, held: NDArray[np.intp], half: int) -> bool:
    """Return whether the last two halves at the ends `held` (holds, 1) differ only by noise; False with few holds."""
    if len(held) < MIN_HOLDS:
        return False
    newer, older = (values[held - first - np.arange(half)].mean(axis=1) for first in (0, half))
    change, step = (newer - older)[1:], np.diff(0.5 * (newer + older))
    share = float(change @ step) / max(float(step @ step), 1e-300)
    settling, noise = share**2 * float(np.mean(step**2)), 0.25 * float(np.var(change - share * step))
    return settling < MAX_SETTLING_RATIO * noise


def _average_hold_ends(values: FloatArray, ends: NDArray[np.intp], count: int) -> FloatArray:
    """Return means (holds,) of the last `count` samples of each hold, or of half of a hold shorter than twice that."""
    count_of = np.clip(np.diff(ends, prepend=-1) // 2, 1, count)
    found = values[ends].copy()
    for back in range(1, count):
        inside = count_of > back
        found[inside] += values[ends[inside] - back]
    means: FloatArray = found / count_of
    return means


def _concatenate(parts: Sequence[tuple[FloatArray, ...]]) -> SteadyStates:
    columns: list[list[FloatArray]] = [[], [], [], []]
    reset = np.zeros(sum(len(part[0]) + 1 for part in parts), dtype=bool)
    reset[np.cumsum([0] + [len(part[0]) + 1 for part in parts[:-1]])] = True
    for part in parts:
        cooled = (np.zeros(1), part[1][:1], part[2][:1], np.zeros(1))
        for column, first, rest in zip(columns, cooled, part, strict=True):
            column += [first, rest]
    current, resistance, deflection, weight = (np.concatenate(column) for column in columns)
    return SteadyStates(
        current_mA=current, resistance_ohm=resistance, deflection_um=deflection, weight=weight, reset=reset
    )
