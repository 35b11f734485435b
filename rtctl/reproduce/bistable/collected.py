"""One pass over the campaign: Gram matrices, turning points, kind of motion and three seconds of each record.

Kept in DIR/campaign.npz, so that every step of the study reads it and a stopped study can resume.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.identification.regression.mean_filter import apply_mean_filter
from rtctl.identification.regression.streaming_gram import compute_filtered_gram, compute_weak_gram
from rtctl.orbits.classes import Kind, rule
from rtctl.orbits.settling import repeats
from rtctl.orbits.turning_points import turning_points
from rtctl.output.atomic_write import replacing
from rtctl.reproduce.bistable.protocol import RATE_HZ, Recorded, Shaker, record, shaker
from rtctl.reproduce.study import Run

HALF_WIDTH_S = 0.025
DECIMATION = 10
TAIL_S = 3.0
SAME_POINT = 0.02
"""Distance relative to the motion's size below which stroboscopic points are equal, despite noise and transient."""


class Collected(NamedTuple):
    """Results for all records, in the order of the campaign."""

    campaign: Shaker
    filtered: FloatArray
    """Gram matrices (records, 11, 11) by the paper's filter."""
    weak: FloatArray
    """Gram matrices (records, 11, 11) by bumps."""
    kinds: tuple[Kind, ...]
    """Kinds of motion by the paper's rule."""
    periods: IntArray
    """Periods by the stroboscopic points of the second half; 0: none up to 16."""
    early_periods: IntArray
    """Periods of the first half."""
    points: tuple[FloatArray, ...]
    """Turning points [mm]."""
    tail: FloatArray
    """Displacement and velocity (records, 2, samples) of the end at 1 kHz, filtered as in the paper."""
    phase: FloatArray
    """Phase (records,) of the drive at the tail's first sample."""
    made_s: float
    """Processor time of making the records [s]."""
    gram_s: tuple[float, float]
    """Processor time of the two regressions' passes [s]."""

    @property
    def frequency_hz(self) -> FloatArray:
        """Drive frequency (records,) [Hz]."""
        return np.array([one.frequency_hz for one in self.campaign.settings])

    @property
    def second_mode(self) -> NDArray[np.bool_]:
        """Which records (records,) contain the second mode, which the study must find out."""
        return np.array([one.second_mode for one in self.campaign.settings])

    @property
    def ends_through(self) -> NDArray[np.bool_]:
        """Which records (records,) go through both wells in their last seconds, whatever they did before."""
        ends: NDArray[np.bool_] = (self.tail[:, 0].min(axis=1) < 0.0) & (self.tail[:, 0].max(axis=1) > 0.0)
        return ends

    @property
    def interwell(self) -> NDArray[np.bool_]:
        """Which records (records,) are interwell or chaotic, the paper's darker colour."""
        return np.array([kind is not Kind.INTRAWELL for kind in self.kinds])


def collected(run: Run) -> Collected:
    """Return the results of the study's campaign, from its folder or computed."""
    return _collected(run.out / "campaign.npz", run.short)


@lru_cache(maxsize=2)
def _collected(path: Path, short: bool) -> Collected:
    campaign = shaker(short=short)
    found = _stored(path, campaign)
    if found is None:
        found = collect(campaign)
        _store(path, found)
    return found


def collect(campaign: Shaker, report: Callable[[int], None] = lambda done: None) -> Collected:
    """Process one record after the other, with one in memory."""
    h = 1.0 / RATE_HZ
    filtered, weak, kinds, points, tails = [], [], [], [], []
    periods, phases = [], []
    made, by_filter, by_bumps = 0.0, 0.0, 0.0
    for done, setting in enumerate(campaign.settings):
        marks = [time.process_time()]
        one = record(campaign, setting)
        marks.append(time.process_time())
        filtered.append(compute_filtered_gram(one.displacement, one.frame_velocity, h))
        marks.append(time.process_time())
        weak.append(compute_weak_gram(one.displacement, one.frame_velocity, h, HALF_WIDTH_S))
        marks.append(time.process_time())
        if done:  # the first one compiles
            made, by_filter, by_bumps = (
                total + after - before
                for total, before, after in zip((made, by_filter, by_bumps), marks, marks[1:], strict=False)
            )
        z, v = looked_at(one.displacement)
        turns = turning_points(z[:, None], v[:, None], np.array([DECIMATION * h]))[0]
        kinds.append(rule(turns))
        points.append(turns)
        periods.append([_period(one, z, v, half) for half in (1, 0)])
        count = round(TAIL_S / (DECIMATION * h))
        tails.append(np.stack([z[-count:], v[-count:]]))
        first = one.phase + 2.0 * np.pi * setting.frequency_hz * ((len(z) - count) * DECIMATION + _FIRST) * h
        phases.append(first % (2.0 * np.pi))
        report(done + 1)
    share = len(campaign.settings) / max(1, len(campaign.settings) - 1)
    return Collected(
        campaign, np.array(filtered), np.array(weak), tuple(kinds), np.array(periods)[:, 0],
        np.array(periods)[:, 1], tuple(points), np.array(tails), np.array(phases), made * share,
        (by_filter * share, by_bumps * share),
    )  # fmt: skip


_FIRST = 20
"""Sample of the record at which `looked_at` starts: ten of the filter and one of its own steps."""


def looked_at(displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity at 1 kHz by the paper's filter and central differences."""
    z = apply_mean_filter(displacement)
    v = (z[2:] - z[:-2]) * (0.5 * RATE_HZ)
    inner = z[1:-1]
    begin = _FIRST - 11
    return inner[begin::DECIMATION], v[begin::DECIMATION]


def _period(one: Recorded, z: FloatArray, v: FloatArray, half: int) -> int:
    """Return the period from the stroboscopic points of a half of the record."""
    frequency = one.setting.frequency_hz
    t = (_FIRST + DECIMATION * np.arange(len(z))) / RATE_HZ
    turns = (one.phase / (2.0 * np.pi) + frequency * t[[0, -1]]).tolist()
    crests = (np.arange(np.ceil(turns[0]), np.floor(turns[1])) - one.phase / (2.0 * np.pi)) / frequency
    chosen = crests[len(crests) // 2 :] if half else crests[: len(crests) // 2]
    at = np.stack([np.interp(chosen, t, signal) for signal in (z, v / (2.0 * np.pi * frequency))])
    return int(repeats(at[0][:, None], at[1][:, None], SAME_POINT, clearly=5.0)[0])


def _store(path: Path, found: Collected) -> None:
    lengths = np.array([len(one) for one in found.points])
    with replacing(path) as partial, partial.open("wb") as file:
        np.savez(
            file, key=_key(found.campaign), filtered=found.filtered, weak=found.weak,
            kinds=np.array([str(kind) for kind in found.kinds]), periods=found.periods,
            early_periods=found.early_periods, lengths=lengths, points=np.concatenate(found.points),
            tail=found.tail, phase=found.phase, times=np.array([found.made_s, *found.gram_s]),
        )  # fmt: skip


def _key(campaign: Shaker) -> str:
    return repr((campaign.seed, campaign.record_s, len(campaign.settings), campaign.truth, 3))


def _stored(path: Path, campaign: Shaker) -> Collected | None:
    if not path.is_file():
        return None
    with np.load(path) as kept:
        if str(kept["key"]) != _key(campaign):
            return None
        times = kept["times"].tolist()
        return Collected(
            campaign, kept["filtered"], kept["weak"], tuple(Kind(str(one)) for one in kept["kinds"]),
            kept["periods"], kept["early_periods"],
            tuple(np.split(kept["points"], np.cumsum(kept["lengths"])[:-1])), kept["tail"], kept["phase"],
            times[0], (times[1], times[2]),
        )  # fmt: skip
