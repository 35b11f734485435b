"""A model's orbits by the paper's sweep: a grid of ten by ten starts at every frequency, followed until they repeat."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.orbits.classes import Orbits, Patience, classify
from rtctl.orbits.forced import Drive, Lanes
from rtctl.reproduce.bistable.models import Beam, model_file
from rtctl.reproduce.bistable.protocol import AMPLITUDE, STARTS, UNITS, shaker
from rtctl.wiring_models import build_forced

ROWS_PER_PERIOD = 64
STEPS_PER_PERIOD = 128
THREADS = 2


class Swept(NamedTuple):
    """Orbits of one model from all starts at all frequencies."""

    drive: Drive
    lanes: Lanes
    orbits: Orbits
    processor_s: float


@lru_cache(maxsize=16)
def swept(beam: Beam, short: bool) -> Swept:
    """Sweep a model; `short`: four by four starts, half as long."""
    frequencies = np.unique([one.frequency_hz for one in shaker(short=short).settings])
    count = 4 if short else 10
    z, v = np.meshgrid(*(np.linspace(*limits, count) for limits in STARTS))
    starts = np.column_stack([z.ravel(), v.ravel()])
    drive = Drive(build_forced(model_file(beam), UNITS, "the beam"), STEPS_PER_PERIOD)
    own = np.array([one.value for one in drive.model.parameters])
    patience = Patience(50.0, 150.0) if short else Patience(100.0, 1000.0)

    def at(some: FloatArray) -> tuple[Lanes, Orbits]:
        frequency = np.repeat(some, len(starts))
        lanes = Lanes(np.tile(own, (len(frequency), 1)), frequency, np.full(len(frequency), AMPLITUDE))
        return lanes, classify(drive, lanes, np.tile(starts, (len(some), 1)), patience)

    begun = time.process_time()
    with ThreadPoolExecutor(THREADS) as pool:
        parts = list(pool.map(at, np.array_split(frequencies, min(len(frequencies), 9))))
    lanes = Lanes(*(np.concatenate([part[0][k] for part in parts]) for k in range(3)))
    orbits = Orbits(
        kind=[kind for _, one in parts for kind in one.kind],
        by_rule=[kind for _, one in parts for kind in one.by_rule],
        period=np.concatenate([one.period for _, one in parts]),
        settled_s=np.concatenate([one.settled_s for _, one in parts]),
        exponent=np.concatenate([one.exponent for _, one in parts]),
        state=np.concatenate([one.state for _, one in parts]),
        points=[points for _, one in parts for points in one.points],
    )
    return Swept(drive, lanes, orbits, time.process_time() - begun)


class Orbit(NamedTuple):
    """One period of a motion that repeats, from a crest of the drive."""

    time_s: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    points: FloatArray


def orbits_at(found: Swept, frequency_hz: float, *, interwell: bool) -> list[Orbit]:
    """Return the different orbits of a model at a frequency, through both wells or in one."""
    seen: dict[tuple[int, float, float], Orbit] = {}
    for lane in np.flatnonzero(
        (found.lanes.frequency_hz == frequency_hz) & (found.orbits.period > 0)
    ).tolist():
        points = found.orbits.points[lane]
        if not len(points) or interwell == bool((points > 0.0).all() or (points < 0.0).all()):
            continue
        period = int(found.orbits.period[lane])
        key = period, round(float(points.min()), 1), round(float(points.max()), 1)
        if key not in seen:
            chosen = np.array([lane])
            motion = found.drive.march(
                found.lanes.of(chosen), found.orbits.state[chosen], period, ROWS_PER_PERIOD
            )  # fmt: skip
            time_s = np.arange(len(motion.displacement)) / (frequency_hz * ROWS_PER_PERIOD)
            seen[key] = Orbit(time_s, motion.displacement[:, 0], motion.velocity[:, 0], points)
    return [*seen.values(), *(mirrored(one) for one in seen.values())]


def mirrored(one: Orbit) -> Orbit:
    """Return the orbit that an odd force has as well: mirrored in both axes, half a drive period later."""
    half = ROWS_PER_PERIOD // 2
    z, v = (-np.roll(signal[:-1], half) for signal in (one.displacement, one.velocity))
    return Orbit(one.time_s, np.append(z, z[0]), np.append(v, v[0]), -one.points)


def nearest_orbit(orbits: list[Orbit], z: FloatArray, v: FloatArray) -> Orbit | None:
    """Return the orbit nearest by the paper's equation (4): mean square of state (mm, mm/s) and mean displacement."""
    if not orbits:
        return None
    size = float(np.mean(z**2) + np.mean(v**2))

    def apart(one: Orbit) -> tuple[bool, float]:
        other_side = bool(np.sign(one.displacement[:-1].mean().round(1)) != np.sign(z.mean().round(1)))
        return other_side, abs(
            float(np.mean(one.displacement[:-1] ** 2) + np.mean(one.velocity[:-1] ** 2)) - size
        )

    return min(orbits, key=apart)
