"""Many starts under one harmonic drive, frequency after frequency, for a sweep with basins of attraction.

u(t) = amplitude cos(2 pi f t), a whole number of steps a period, so that one period of drive serves all of them and
every n-th row is a point of the stroboscopic map.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.motion import Equation
from rtctl.border.arrays import FloatArray

STEPS_PER_PERIOD = 128
"""Steps in a period of the drive: the published sweep's."""
BLOCK_STEPS = 4096
"""Steps marched in one call: 100 kB of drive stay in the cache, and a call's own cost does not count."""


class Trajectories(NamedTuple):
    """Trajectories (rows, lanes) of all starts, a row every so many steps; the first is the start."""

    displacement: FloatArray
    velocity: FloatArray


def harmonic_nodes(amplitude: float, periods: int, steps_per_period: int = STEPS_PER_PERIOD) -> FloatArray:
    """Return the drive (steps, 3) at the start, middle and end of each step."""
    half_steps = 0.5 * np.arange(3) + np.arange(steps_per_period)[:, None]
    one: FloatArray = amplitude * np.cos(2.0 * np.pi * half_steps / steps_per_period)
    return np.tile(one, (periods, 1))


def follow(
    equation: Equation,
    starts: FloatArray,
    amplitude: float,
    frequency_hz: float,
    periods: int,
    *,
    steps_per_period: int = STEPS_PER_PERIOD,
    rows_per_period: int = 1,
) -> Trajectories:
    """Follow all `starts` (lanes, 2) through `periods` periods; one row per period is the stroboscopic map.

    Raises:
        ValueError: `rows_per_period` does not divide `steps_per_period`, or the equation has states or drifts: it must
            be the same in every period.
    """
    if steps_per_period % rows_per_period:
        raise ValueError(
            f"{rows_per_period} rows do not divide a period of {steps_per_period} steps; use a divisor"
        )
    if equation.memories or "drift" in equation.terms:
        raise ValueError(
            "a sweep needs an equation without memory and drift: they go on from period to period"
        )
    lanes, substeps = len(starts), steps_per_period // rows_per_period
    shape = (periods * rows_per_period + 1, lanes)
    trajectories = Trajectories(np.empty(shape), np.empty(shape))
    z, v = starts[:, 0].copy(), starts[:, 1].copy()
    block = min(periods, max(1, BLOCK_STEPS // steps_per_period))
    drive = Driven(
        harmonic_nodes(amplitude, block, steps_per_period), 1.0 / (frequency_hz * steps_per_period)
    )
    for first in range(0, periods, block):
        count = min(block, periods - first)
        rows = slice(first * rows_per_period, (first + count) * rows_per_period + 1)
        part = drive._replace(nodes=drive.nodes[: count * steps_per_period])
        equation.march(z, v, part, substeps, (trajectories.displacement[rows], trajectories.velocity[rows]))
    return trajectories


def sweep(
    equation: Equation,
    starts: FloatArray,
    amplitude: float,
    frequencies_hz: Iterable[float],
    duration_s: float,
    *,
    steps_per_period: int = STEPS_PER_PERIOD,
    threads: int = 1,
) -> Iterator[Trajectories]:
    """Yield the stroboscopic map of all `starts` at each frequency, for the whole periods in `duration_s`; in order."""

    def at(frequency_hz: float) -> Trajectories:
        periods = max(1, round(duration_s * frequency_hz))
        return follow(
            equation, starts, amplitude, frequency_hz, periods, steps_per_period=steps_per_period
        )  # fmt: skip

    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(at, frequencies_hz)
