"""Draws what is hidden in a torsion balance, and makes it as large as wished: by the rules of `foreign_response_sizes`.

The share of an effect is what a re-fit of the user's own model leaves: RMS error over RMS of the readings about their
mean, in free runs of two records that are not for tests, the first state known.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
from foreign_common import Array
from foreign_kept_torsion_device import PIECES, simulate
from foreign_kept_torsion_styles import TorsionBench, draw_bench
from foreign_oscillator_device import Effect, Record, natural_square
from foreign_oscillator_guesses import first_guess
from foreign_oscillator_sizes import LINEAR, case_of
from foreign_response_sizes import COMPARED, as_wished, fitted_law
from scipy.optimize import least_squares

FITS = 20  # steps of the re-fit: a stiffer fibre is many line widths away
LEAST_DAMPING, LEAST_STIFFNESS = -0.95, -0.9  # changes that the re-fit may make, of their value
SOFTEST = -0.6  # cubic over linear torque at the largest motion, of the re-fit: beyond, the fibre gives way
WINDOW = 3.0  # natural periods
EXPONENTS = (0.4, 1.4, 1.8, 2.6)
Hidden = tuple[TorsionBench, tuple[Effect, ...], tuple[float, ...]]


@cache
def hide(style: str, seed: int, names: tuple[str, ...]) -> Hidden:
    """The bench with these effects in sizes of the seed; ValueError for one that has no size that can be seen."""
    bench = draw_bench(style, seed, linear=bool(LINEAR & set(names)))
    return case_of(bench, seed, names, sized_effect, share_left)


def sized_effect(
    bench: TorsionBench, seed: int, name: str, share: float | None = None
) -> tuple[Effect, float]:
    """The effect with a drawn (or given) share, and the share that it reaches."""
    return as_wished(bench, seed, name, share, guess, share_left, bench.device.period_s / PIECES)


def guess(bench: TorsionBench, name: str, rng: np.random.Generator) -> tuple[Effect, float, float]:
    """A middling size with its smallest and largest; a power of this lab's own, at one speed with one torque."""
    effect, low, high = first_guess(bench, name, rng)
    if name != "damping.power":
        return effect, low, high
    exponent, speed = (
        float(rng.choice(EXPONENTS)),
        float(np.sqrt(natural_square(bench.device.law))) * bench.largest,
    )
    ratio = speed ** (effect.values["exponent"] - exponent)
    unit = f"rad^{1 - exponent:g}*s^{exponent - 2:g}"
    effect = replace(effect, size=effect.size * ratio, unit=unit, values={"exponent": exponent})
    return effect, low * ratio, high * ratio


def share_left(bench: TorsionBench, effects: tuple[Effect, ...]) -> float:
    """RMS of what a re-fit of the user's model leaves, over the RMS of the readings about their mean."""
    device, law = bench.device, bench.device.law
    records = [record for record in bench.records if record.use != "test"][:COMPARED]
    real = [simulate(device, record, effects) for record in records]
    wanted = np.concatenate([swing.reading for swing in real])
    if not np.isfinite(wanted).all():
        return inf
    spread, per_cubic = float(np.std(wanted)), law.stiffness / bench.largest**2

    def left(x: Array) -> Array:
        trial = replace(device, law=fitted_law(law, x, bench.quality, per_cubic))
        runs = [simulate(trial, r, (), swing.start).reading for r, swing in zip(records, real, strict=True)]
        error = np.nan_to_num((np.concatenate(runs) - wanted) / spread, nan=1e3)
        return np.asarray(np.clip(error, -1e3, 1e3))

    starts = np.zeros((2, 4 if bench.cubic_known else 3))
    starts[1] = regression(bench, records, [swing.reading for swing in real])
    first = min(starts, key=lambda x: float(np.sum(left(x) ** 2)))
    found = least_squares(
        left,
        first,
        bounds=(least_changes(bench)[: first.size], np.inf),
        x_scale=0.1,
        diff_step=[1e-4] * first.size,
        ftol=1e-3,
        xtol=1e-5,
        max_nfev=FITS,
    )
    return float(np.sqrt(np.mean(found.fun**2)))


def regression(bench: TorsionBench, records: list[Record], readings: list[Array]) -> Array:
    """The re-fit's first guess: changes of damping, stiffness (in line widths), gain and, if the user has one, cubic.

    Each window p of `WINDOW` periods gives one equation, by parts: sum p'' z - d p' z + p (k z + c z^3) = sum g p u.
    """
    law, period = bench.device.law, bench.device.period_s
    size = round(WINDOW * 2.0 * np.pi / np.sqrt(law.stiffness) / period)
    place, turn = np.pi * np.linspace(0.0, 1.0, size), np.pi / (period * (size - 1))
    sine, cosine = np.sin(place), np.cos(place)
    window, slope = sine**4, 4.0 * turn * sine**3 * cosine
    bend, terms = 4.0 * turn**2 * sine**2 * (3.0 * cosine**2 - sine**2), []
    for record, z in zip(records, readings, strict=True):
        pairs = ((z, -slope), (z, window), (record.drive, -window), (z**3, window), (z, -bend))
        terms.append(np.column_stack([np.correlate(x, p, "valid") for x, p in pairs]))
    table, count = np.concatenate(terms), 4 if bench.cubic_known else 3
    size_of = np.linalg.norm(table, axis=0)
    found = np.linalg.lstsq((table / size_of)[:, :count], table[:, 4], rcond=None)[0] / size_of[:count]
    true = np.array([law.damping, law.stiffness, law.gain, law.cubic])[:count]
    scale = np.array([law.damping, law.stiffness / bench.quality, law.gain, law.stiffness / bench.largest**2])
    return np.asarray(np.maximum((found - true) / scale[:count], 0.99 * least_changes(bench)[:count]))


def least_changes(bench: TorsionBench) -> Array:
    """The least changes that a re-fit may make: beyond these the damping or the fibre gives way."""
    softest = SOFTEST - bench.device.law.cubic * bench.largest**2 / bench.device.law.stiffness
    return np.array([LEAST_DAMPING, LEAST_STIFFNESS * bench.quality, -2.0, softest])
