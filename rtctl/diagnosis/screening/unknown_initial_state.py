"""Records that begin in motion, as a period of a steady state does: what acted before their first sample is unknown.

The motion's own start is fitted, but what a lag, a delay, a yielding force or a second mass holds by then would be
taken to be at rest; its traces in the first periods decide between causes that are one law otherwise, wrongly. There a
record starts the state and is not scored. So it is with a plant that remembers, of a record that does not begin where a
full cooling leaves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord

FEWEST = 6
"""Readings whose cubic tells how a record begins; more where noise asks for it."""
EXACT = 0.05
"""Standard error of the velocity that is small enough."""
LOOKED_AT = 0.15
"""Of a period, at most: further on a cubic does not follow the motion."""
MOVES = 0.3
"""Velocity times the period over 2 pi, of the displacement or its RMS, whichever is larger, with which a record begins
that is in motion; of the blind generator's, all at rest or released, the largest is 0.29, by noise."""
CERTAIN = 4.0
"""Standard errors that this is at least."""
NOISE_OF_DIFFERENCES = 0.6745 * 70.0**0.5
"""Median size of fourth differences of white noise of variance 1."""
RESTS = 0.1
"""Below, a record rests beside others that are in motion, if its displacement is that small too, or the manifest says
where it was let go: any ring-down has moments like that."""
WARM_PERIODS = (10.0, 30.0)
"""That start the state, at least and at most: a light second mode takes long to forget."""
WARM_PERIODS_OF_WELLS = (2.0, 2.0)
"""The same where a motion has two wells: after a few periods that nothing scores it may be in the other one."""
SHARE = 0.1
"""Of a record, between them."""
MOST = 0.25
"""Of a record, whatever its periods."""
SAID = (
    "{} of {} records begin in motion: what acted before their first sample is not known, so their first {:.3g} s "
    "start the state and are not scored"
)
OFF = 0.05
"""Of a reading's variation, by which the first ones of a plant that remembers are off at least, and so many (FAR_OFF)
times what they are off by later: then it began elsewhere."""
FAR_OFF = 10.0
FIRST = 3
BLOCKS = 64
"""Of a record; what it remembers is over after the first of which, and of the next, the error is usual (USUAL)."""
USUAL = 3.0
REMEMBERS = (
    "{} not begin where a full cooling leaves the device (first readings are off by {:.0%} of the signal's RMS): what "
    "acted before is not known, so the first {:.3g} s, until that is forgotten, are not scored. Was it cut from a "
    "longer record?"
)


def warmed_up(
    fit: Sequence[FitRecord], tests: Sequence[FitRecord], rate: float, *, two_wells: bool = False
) -> tuple[tuple[FitRecord, ...], tuple[FitRecord, ...], list[str]]:
    """Records to fit and to test without the first periods, at `rate` [1/s], of those that begin in motion; what is to
    be said. They know their velocity there.
    """
    both = [*fit, *tests]
    begins = [_Beginning.of(record, rate) for record in both]
    warm, periods = both, WARM_PERIODS_OF_WELLS if two_wells else WARM_PERIODS
    if any(begin.moves for begin in begins):
        warm = [
            record if begin.rests else _from(record, 2.0 * np.pi / rate, periods)
            for record, begin in zip(both, begins, strict=True)
        ]
    moved = [new for new, old in zip(warm, both, strict=True) if new.first > old.first]
    first_s = max((record.first * record.period_s for record in moved), default=0.0)
    said = [SAID.format(len(moved), len(both), first_s)] if moved else []
    warm = [_as_it_moves(record, begin) for record, begin in zip(warm, begins, strict=True)]
    return tuple(warm[: len(fit)]), tuple(warm[len(fit) :]), said


def has_two_wells(simulation: Simulation) -> bool:
    """Whether its stiffness is negative: between two wells."""
    return any(one.name == "stiffness" and one.value < 0.0 for one in simulation.parameters)


def forgotten(
    fit: Sequence[FitRecord], tests: Sequence[FitRecord], simulation: Simulation
) -> tuple[tuple[FitRecord, ...], tuple[FitRecord, ...], list[str]]:
    """Records of a plant that remembers, without what of them depends on a history that is not known; what is to be
    said.
    """
    both = [*fit, *tests]
    values = np.array([one.value for one in simulation.parameters])
    found = [_remembered(record, simulation, values) for record in both]
    known = [
        replace(record, first=max(record.first, count))
        for record, (count, _) in zip(both, found, strict=True)
    ]
    moved = [new for new, old in zip(known, both, strict=True) if new.first > old.first]
    said = []
    if moved:
        names = ", ".join(dict.fromkeys(one.name for one in moved))
        words = f"record {names} does" if len(moved) == 1 else f"records {names} do"
        first_s = max(one.first * one.period_s for one in moved)
        said.append(REMEMBERS.format(words, max(off for _, off in found), first_s))
    return tuple(known[: len(fit)]), tuple(known[len(fit) :]), said


def _remembered(record: FitRecord, simulation: Simulation, values: FloatArray) -> tuple[int, float]:
    """Samples until the errors of a run from a full cooling are as usual, and what the first are off by; 0 where they
    begin so, or never become so.
    """
    block = max(FIRST, record.samples // BLOCKS)
    count = record.samples // block
    late, worst = 0, 0.0
    try:
        run = simulation.predict(record.stimulus, values)
    except ValueError:  # said where it is fitted
        return 0, 0.0
    for name in (one for one in simulation.outputs if one in record.measured):
        error = np.nan_to_num(run.outputs[name][0] - record.measured[name], posinf=0.0, neginf=0.0)
        rms = np.sqrt(np.mean(error[: count * block].reshape(count, block) ** 2, axis=1))
        usual, size = float(np.median(rms)), float(record.measured[name].std())
        off = abs(float(error[:FIRST].mean()))
        if not off > max(FAR_OFF * usual, OFF * size):
            continue
        good = rms < USUAL * usual
        over = np.flatnonzero(good[:-1] & good[1:])
        if len(over) and over[0] <= count // 2:
            late, worst = max(late, int(over[0]) * block), max(worst, off / size)
    return late, worst


class _Beginning(NamedTuple):
    """Sizes at a record's first sample, in RMS of its displacement about the mean."""

    displacement: float
    velocity: float
    """Over the dominant angular frequency."""
    error: float
    """Standard, of that by noise."""
    units_per_s: float
    """The velocity, with its sign."""
    report: bool
    """Whether the manifest says where the record begins."""

    @property
    def moves(self) -> bool:
        """For certain."""
        return self.velocity > max(MOVES * max(1.0, self.displacement), CERTAIN * self.error)

    @property
    def rests(self) -> bool:
        """As far as can be seen."""
        still = self.velocity < RESTS * max(1.0, self.displacement)
        return still and (self.report or self.displacement < RESTS)

    @classmethod
    def of(cls, record: FitRecord, rate: float) -> _Beginning:
        """By the cubic through the first readings, `rate` [1/s] of the motion."""
        measured = record.measured.get("displacement")
        size = float(measured.std()) if measured is not None and record.samples > FEWEST else 0.0
        if measured is None or size == 0.0:
            return cls(0.0, 0.0, 0.0, 0.0, report=False)
        noise = float(np.median(np.abs(np.diff(measured, 4)))) / NOISE_OF_DIFFERENCES / size
        most = min(record.samples, round(2.0 * np.pi * LOOKED_AT / rate / record.period_s))
        count, solution = FEWEST, _cubic(FEWEST, rate * record.period_s)
        while count < most and noise * float(np.linalg.norm(solution[1])) > EXACT:
            count = min(2 * count, most)
            solution = _cubic(count, rate * record.period_s)
        displacement, velocity = solution @ (measured[:count] - measured.mean()) / size
        error = noise * float(np.linalg.norm(solution[1]))
        report = "displacement" in record.stimulus.initial.keys() - record.stimulus.read
        return cls(abs(displacement), abs(velocity), error, float(velocity) * size * rate, report)


def _cubic(count: int, step: float) -> FloatArray:
    """(2, count) that makes value and slope at the first of readings a `step` apart of them."""
    basis = np.vander(step * np.arange(count), 4, increasing=True)
    found: FloatArray = np.linalg.pinv(basis)[:2]
    return found


def _from(record: FitRecord, period_s: float, periods: tuple[float, float]) -> FitRecord:
    least, most = (round(count * period_s / record.period_s) for count in periods)
    warm = min(int(np.clip(SHARE * record.samples, least, most)), int(MOST * record.samples))
    return replace(record, first=max(record.first, warm))


def _as_it_moves(record: FitRecord, begin: _Beginning) -> FitRecord:
    """With its velocity at the first sample, if that is not said already; at rest where it hardly moves, as a
    manifest that says nothing has it.
    """
    if not (record.first and begin.moves) or "velocity" in record.stimulus.initial:
        return record
    initial = {**record.stimulus.initial, "velocity": begin.units_per_s}
    return replace(record, stimulus=replace(record.stimulus, initial=initial))
