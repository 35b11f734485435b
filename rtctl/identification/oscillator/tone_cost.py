"""Cost of a Duffing oscillator under one tone against a record: simulated and scored in the cache, 32 sets at a time.

    z'' + c z' + k z + b z^3 = F cos(w t),   z(0), z'(0) given

Strang splitting at the sample period h: half a kick v <- v - h b z^3 / 2, the damped driven linear flow exactly, half
a kick. With P the linear steady state, Re C exp(i w t), C = F / (k - w^2 + i c w), the difference d = (z, v) - P obeys
d <- E d, a constant matrix of each lane; so a step costs a product with E, one rotation of the phasor, and a cube.
A linear oscillator is exact at any h; kicks need 12 samples a period (`splitting_steps` says why).

Reference: Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), II.5. Objectives: the ME paper, section 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.identification.oscillator.tone_kernels import (
    BLOCK,
    DV,
    DZ,
    E00,
    E01,
    E10,
    E11,
    KICK,
    LANES,
    MAX_ERROR,
    MIN_ERROR,
    PC,
    PRODUCT,
    PS,
    ROT_C,
    ROT_S,
    ROWS,
    SQUARE,
    SUM,
    march_and_keep,
    march_and_match,
    march_and_sum,
)

NAMES = ("damping", "stiffness", "stiffness_cubic", "force", "rate")
"""Order of a parameter set, in 1/s, 1/s^2, 1/(z^2 s^2), z/s^2 and rad/s."""
MIN_SAMPLES_PER_PERIOD = 12.0


class Objective(StrEnum):
    """Quantity to be minimised; all are 0 for a perfect model."""

    PEAK_TO_PEAK = "peak-to-peak"
    """Peak-to-peak error relative to the record's peak-to-peak value."""
    PEAK_INDEX = "peak index"
    """Mean distance of a peak from the record's, in half periods. Insensitive to the amplitude."""
    CORRELATION = "correlation"
    """1 minus the correlation coefficient. Insensitive to the amplitude."""
    RMS = "rms"
    """RMS error relative to the record's RMS; not in the paper, for comparison."""


class Scores(NamedTuple):
    """Scores of each parameter set (n,)."""

    rms: FloatArray
    correlation: FloatArray
    peak_to_peak: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ToneRecord:
    """A displacement (n,) sampled every `period_s` from the start of the tone, scored from sample `first` on."""

    displacement: FloatArray
    period_s: float
    first: int = 0
    start: tuple[float, float] = (0.0, 0.0)
    """Displacement and velocity at the first sample."""

    def __post_init__(self) -> None:
        if not 0 <= self.first < len(self.displacement):
            raise ValueError(f"first must lie within {len(self.displacement)} samples, got {self.first!r}")
        if not self.period_s > 0.0:
            raise ValueError(f"period_s must be > 0 s, got {self.period_s!r}")

    @cached_property
    def peaks(self) -> IntArray:
        """Indices of the record's maxima from `first` on: one between two rises through its mean."""
        z = self.displacement - self.displacement[self.first :].mean()
        rises = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
        rises = rises[rises >= self.first]
        found = [a + int(np.argmax(z[a : b + 1])) for a, b in zip(rises[:-1], rises[1:], strict=True)]
        return np.array(found, dtype=np.int64)


def compute_cost(record: ToneRecord, objective: Objective, sets: FloatArray) -> FloatArray:
    """Return the objective (n,) of parameter sets (n, 5) as `NAMES`; infinite where a set is not underdamped.

    Raises:
        ValueError: The tone has fewer than 12 samples a period.
    """
    if objective is Objective.PEAK_INDEX:
        return _compute_peak_cost(record, sets)
    scores = compute_scores(record, sets)
    if objective is Objective.CORRELATION:
        return 1.0 - scores.correlation
    return scores.peak_to_peak if objective is Objective.PEAK_TO_PEAK else scores.rms


def compute_scores(record: ToneRecord, sets: FloatArray) -> Scores:
    """Return all scores but the peaks' index of parameter sets (n, 5); infinite where a set is not underdamped."""
    scored = record.displacement[record.first :]
    mean, size = float(scored.mean()), float(np.sqrt(np.mean(scored**2)))
    spread = float(np.ptp(scored))
    count = len(scored)
    table, valid = _accumulate_sums(record, sets)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        variance = table[SQUARE] / count - (table[SUM] / count) ** 2
        r = (table[PRODUCT] / count - table[SUM] / count * mean) / np.sqrt(variance * scored.var())
        rms = np.sqrt(np.maximum(table[SQUARE] / count - 2.0 * table[PRODUCT] / count + size**2, 0.0)) / size
        good = valid & np.isfinite(rms) & np.isfinite(r)
    return Scores(
        np.where(good, rms, np.inf),
        np.where(good, r, 0.0),
        np.where(good, (table[MAX_ERROR] - table[MIN_ERROR]) / spread, np.inf),
    )


def compute_sizes(record: ToneRecord, sets: FloatArray) -> FloatArray:
    """Return the RMS (n,) of the motions themselves over the scored samples; infinite where there is none."""
    table, valid = _accumulate_sums(record, sets)
    return np.where(valid, np.sqrt(table[SQUARE] / (len(record.displacement) - record.first)), np.inf)


def _accumulate_sums(record: ToneRecord, sets: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return sums (5, n) of all sets, and which of them are underdamped oscillators (n,)."""
    table, valid = np.empty((5, len(sets))), np.empty(len(sets), dtype=np.bool_)
    for part in _split_lanes(sets):
        work, valid[part] = pack_lanes(sets[part], record)
        sums = np.zeros(5 * LANES)
        sums[MIN_ERROR * LANES : MAX_ERROR * LANES], sums[MAX_ERROR * LANES :] = np.inf, -np.inf
        march_and_sum(work, record.displacement, record.first, np.zeros(BLOCK * LANES), sums)
        table[:, part] = sums.reshape(5, LANES)[:, : part.stop - part.start]
    return table, valid


def simulate_tone(record: ToneRecord, values: FloatArray) -> FloatArray:
    """Return the displacement (n,) of one parameter set (5,) at the record's samples."""
    work, valid = pack_lanes(values[None, :], record)
    if not valid[0]:
        raise ValueError("these values are no underdamped oscillator: stiffness must be > damping^2 / 4")
    out = np.empty(len(record.displacement))
    march_and_keep(work, np.zeros(BLOCK * LANES), out)
    return out


def pack_lanes(sets: FloatArray, record: ToneRecord) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Pack up to `LANES` sets for the kernels (ROWS LANES,); also return which are underdamped oscillators."""
    h = record.period_s
    c, k, b, force, w = np.asarray(sets, dtype=np.float64).T
    if (w * h * MIN_SAMPLES_PER_PERIOD > 2.0 * math.pi * (1.0 + 1e-9)).any():
        raise ValueError(
            f"a tone of {w.max() / (2.0 * math.pi):.6g} Hz has fewer than {MIN_SAMPLES_PER_PERIOD:g} samples a period "
            f"at {1.0 / h:.6g} Hz: sample faster"
        )
    valid = (k > 0.25 * c * c) & (c >= 0.0)
    k, c = np.where(valid, k, 1.0 / (h * h) * 1e-4), np.where(valid, c, 0.0)
    wd = np.sqrt(k - 0.25 * c * c)
    shrink, cos, sin = np.exp(-0.5 * c * h), np.cos(wd * h), np.sin(wd * h)
    phasor = force / (k - w * w + 1j * c * w)  # P = Re phasor exp(i w t)
    work = np.zeros((ROWS, LANES))
    n = len(c)
    z0, v0 = record.start
    work[DZ, :n], work[DV, :n] = z0 - phasor.real, v0 + w * phasor.imag
    work[DV, :n] -= 0.5 * h * b * z0**3
    work[PC, :n], work[PS, :n] = phasor.real, phasor.imag
    work[E00, :n], work[E01, :n] = shrink * (cos + 0.5 * c / wd * sin), shrink * sin / wd
    work[E10, :n], work[E11, :n] = -shrink * k / wd * sin, shrink * (cos - 0.5 * c / wd * sin)
    work[ROT_C, :n], work[ROT_S, :n], work[KICK, :n] = np.cos(w * h), np.sin(w * h), h * b
    return np.ascontiguousarray(work.reshape(-1)), valid


def _split_lanes(sets: FloatArray) -> Iterator[slice]:
    """Yield slices of as many sets as there are lanes."""
    for begin in range(0, len(sets), LANES):
        yield slice(begin, min(begin + LANES, len(sets)))


def _compute_peak_cost(record: ToneRecord, sets: FloatArray) -> FloatArray:
    """Return the mean mismatch (n,) of the peaks' index."""
    found = np.full(len(sets), np.inf)
    for part in _split_lanes(sets):
        work, valid = pack_lanes(sets[part], record)
        found[part] = np.where(valid, _compute_lane_mismatch(record, work)[: len(valid)], np.inf)
    return found


def _compute_lane_mismatch(record: ToneRecord, work: FloatArray) -> FloatArray:
    """Return the mean mismatch (LANES,) of one packed part."""
    found = record.peaks
    ends = (found[:-1] + found[1:]) // 2 + 1
    longest = int(max(ends[0], np.diff(ends).max()))
    mismatch = np.zeros(LANES)
    march_and_match(work, found[1:-1], ends, np.zeros(longest * LANES), np.zeros(2 * LANES), mismatch)
    mean: FloatArray = mismatch / (len(ends) - 1)
    return mean
