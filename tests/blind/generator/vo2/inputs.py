"""The records of a case: staircases to identify from, records to fit, records to test at other levels and paces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .excitations import KINDS, Band, excite
from .options import Vo2Options
from .physics import FloatArray
from .plant import Input, Plant, twin
from .staircase import HOLD_SAMPLES, even_levels, held, hold_time, reversal_staircase, shrinking_staircase


def draw_rate(rng: np.random.Generator, options: Vo2Options) -> float:
    """1 to 10 kHz, a round number."""
    return options.sample_rate_Hz or float(
        rng.choice([1000.0, 2000.0, 2500.0, 4000.0, 5000.0, 8000.0, 10_000.0])
    )


def draw_inputs(
    rng: np.random.Generator, options: Vo2Options, plant: Plant, lowest: float, rate_Hz: float
) -> list[Input]:
    """Fit and test records; the first fit record is a multilevel telegraph over the whole range."""
    fits = options.fit_records or int(rng.integers(3, 6))
    tests = options.test_records or int(rng.integers(1, 4))
    repeats = fits > 2 and rng.random() < 0.35
    highest = plant.physics.top_current
    records: list[Input] = []
    for i in range(fits + tests):
        use = "fit" if i < fits else "test"
        if i == 1 and repeats:
            records.append(replace(records[0], position=1))
            continue
        seconds = rng.uniform(1.5, 4.0)
        samples = min(int(seconds * rate_Hz), options.samples or 16_000)
        kind = "telegraph" if i == 0 else str(rng.choice(KINDS))
        whole = i == 0 or rng.random() < 0.4
        low, high = (0.0, 1.0) if whole and use == "fit" else (rng.uniform(0.0, 0.25), rng.uniform(0.75, 1.0))
        square = lowest**2 + np.array([low, high]) * (highest**2 - lowest**2)
        pace = 1.0 if use == "fit" else float(rng.choice([0.6, 0.8, 1.3, 1.6]))
        band = Band(*np.sqrt(square))
        current = excite(rng, kind, samples, rate_Hz, band, lowest, pace)
        records.append(
            Input(number=i, position=i, use=use, excitation=kind, current=current, rate_Hz=rate_Hz)
        )
    return records


def draw_staircases(
    rng: np.random.Generator, options: Vo2Options, plant: Plant, lowest: float, slowest: float
) -> list[Input]:
    """One or two records, sampled so that each hold has its samples and ends settled."""
    count = options.identify_records or int(rng.integers(1, 3))
    rate = HOLD_SAMPLES / hold_time(plant.physics.tau, slowest)
    grid = _grid(plant, lowest)
    levels = [reversal_staircase(grid), shrinking_staircase(rng, grid)][:count]
    return [
        Input(
            number=-1 - i,
            position=-1 - i,
            use="identify",
            excitation=("reversal staircase", "shrinking staircase")[i],
            current=held(steps),
            rate_Hz=float(np.floor(rate)) if rate > 20.0 else float(np.floor(rate * 100) / 100),
        )
        for i, steps in enumerate(levels)
    ]


def _grid(plant: Plant, lowest: float) -> FloatArray:
    """Levels from one loop of the noise-free device, 200 points a branch."""
    low, high = lowest**2, plant.physics.top_current**2
    squares = np.linspace(low, high, 200)
    loop = np.sqrt(np.r_[squares, squares[::-1]])
    slow = Input(number=0, position=0, use="identify", excitation="loop", current=loop, rate_Hz=1.0)
    out = twin(plant, slow)
    ln_R = np.log(out.resistance)
    readings = [ln_R, out.resistance, out.deflection]
    return even_levels(low, high, [branch for y in readings for branch in (y[1:200], y[-1:200:-1])])
