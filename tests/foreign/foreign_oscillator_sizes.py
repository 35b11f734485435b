"""Draws what is hidden in an oscillator, and makes it as large as wished.

The share of an effect is what a re-fit of the user's own model leaves: RMS error over RMS of the motion about its mean.
These are free runs of `COMPARED` records from the true first state (in a bistable beam: anew every four periods).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
from foreign_common import Array, log_uniform, search_size
from foreign_oscillator_device import (
    EFFECTS,
    KNOWN,
    NEW,
    Device,
    Effect,
    Readings,
    Record,
    changed_law,
    natural_square,
    simulate,
    steps_of,
)
from foreign_oscillator_guesses import first_guess
from foreign_oscillator_styles import KEPT, LATER, STYLES, AnyBench, Bench, draw_bench, stream
from scipy.optimize import least_squares

SMALLEST, LARGEST = 0.025, 0.35  # share of the motion
ABOVE_NOISE = 2.0  # a share is at least so many times the noise
COMPARED = 2  # records
FITS = 8  # steps of the re-fit
LINEAR = {"stiffness.cubic", "stiffness.gravity"}  # hidden behind a user's model without a cubic stiffness
SETS = {"known": KNOWN, "new": NEW, "all": EFFECTS}


def draw_names(style: str, seed: int, which: str) -> tuple[int, list[str]]:
    """How many effects are hidden (0, 1 or 2), and all of the set in the order in which they are tried.

    Every sixth seed has none and every sixth two, for seeds one after the other and for styles in turn; over the seeds
    with one, all effects come about equally often.
    """
    place = seed + seed // 4
    names = list(SETS[which])
    order = np.random.default_rng([(*STYLES, *LATER, *KEPT).index(style), 2026]).permutation(len(names))
    number = (
        place // 30 * 23 + place % 30 // 6 * 4 + (0, 1, 0, 2, 3, 0)[place % 6]
    )  # 23 goes through 15, 22, 37
    tried = [names[order[(number + k) % len(names)]] for k in range(len(names))]
    if place % 6 == 2:
        rng = (
            stream(style, seed, "effect")
            if style in STYLES
            else np.random.default_rng([*map(ord, style), seed])
        )
        tried = [str(name) for name in rng.permutation(names)]
    return {5: 0, 2: 2}.get(place % 6, 1), tried


def choose(style: str, seed: int, which: str, hide: Callable[..., object]) -> tuple[str, ...]:
    """The effects of a case: of those that are drawn the first that `hide` can make large enough to be seen."""
    count, tried = draw_names(style, seed, which)
    chosen: tuple[str, ...] = ()
    for name in tried:
        if len(chosen) == count:
            break
        if any(name.split(".")[0] == other.split(".")[0] for other in chosen):
            continue
        try:
            hide(style, seed, (*chosen, name))
        except ValueError:
            continue
        chosen = (*chosen, name)
    return chosen


@cache
def hide(
    style: str, seed: int, names: tuple[str, ...]
) -> tuple[Bench, tuple[Effect, ...], tuple[float, ...]]:
    """The bench with these effects in sizes of the seed; ValueError for one that has no size that can be seen."""
    bench = draw_bench(style, seed, linear=bool(LINEAR & set(names)))
    return case_of(bench, seed, names, sized_effect, share_left)


def case_of(
    bench: AnyBench,
    seed: int,
    names: tuple[str, ...],
    sized: Callable[[AnyBench, int, str], tuple[Effect, float]],
    left: Callable[[AnyBench, tuple[Effect, ...]], float],
) -> tuple[AnyBench, tuple[Effect, ...], tuple[float, ...]]:
    """The bench, each effect as `sized`, and their shares; ValueError if all together leave no finite share."""
    found = [sized(bench, seed, name) for name in names]
    effects = tuple(effect for effect, _ in found)
    if len(effects) > 1 and not np.isfinite(left(bench, effects)):
        raise ValueError(f"{' and '.join(names)} on {bench.style} {seed}: the motion diverges")
    return bench, effects, tuple(share for _, share in found)


def sized_effect(bench: Bench, seed: int, name: str, share: float | None = None) -> tuple[Effect, float]:
    """The effect with a drawn (or given) share, and the share that it reaches."""
    if name not in EFFECTS:
        raise ValueError(f"effect must be one of {', '.join(EFFECTS)}, got {name!r}")
    rng = np.random.default_rng([*map(ord, bench.style), seed, list(EFFECTS).index(name)])
    drawn = log_uniform(rng, 0.03, 0.3)
    wanted = share or max(drawn, 1.5 * ABOVE_NOISE * (bench.white + bench.flicker))
    effect, low, high = first_guess(bench, name, rng)

    def reached(size: float) -> float:
        return share_left(bench, (replace(effect, size=size),))

    size = effect.size if low == high else search_size(reached, effect.size, low, high, wanted)
    if name == "drive.delay":  # whole integration steps
        h = bench.device.period_s / steps_of(bench.device, bench.device.law)
        size = max(round(size / h), 1) * h
    left = reached(size)
    if not max(SMALLEST, ABOVE_NOISE * (bench.white + bench.flicker)) <= left <= LARGEST:
        raise ValueError(f"{name} on {bench.style} {seed}: no size from {low:.3g} to {high:.3g} fits")
    return replace(effect, size=size), left


def share_left(bench: Bench, effects: tuple[Effect, ...]) -> float:
    """RMS of what a re-fit of the user's model leaves, over the RMS of the motion about its mean."""
    device, records = bench.device, bench.records[:COMPARED]
    steps = steps_of(device, changed_law(device.law, effects))
    real = [simulate(device, record, effects, steps) for record in records]
    wanted = np.concatenate([readings.displacement for readings in real])
    if not np.isfinite(wanted).all():
        return inf
    fitted = nominal_fit(bench, device, records, real, steps)
    left = wanted - _displacements(fitted, records, real, steps)
    return float(np.sqrt(np.mean(left**2)) / np.std(wanted))


def nominal_fit(
    bench: Bench, device: Device, records: tuple[Record, ...], real: list[Readings], steps: int
) -> Device:
    """The device whose damping, stiffness, gain (and cubic, if the user's model has one) follow best."""
    law, wanted = device.law, np.concatenate([readings.displacement for readings in real])
    per_cubic = natural_square(law) / bench.largest**2

    def with_values(x: Array) -> Device:
        values = law._replace(
            damping=law.damping * (1.0 + x[0]),
            stiffness=law.stiffness + x[1] * natural_square(law) / bench.quality,
            gain=law.gain * (1.0 + x[2]),
            cubic=law.cubic + (x[3] * per_cubic if x.size > 3 else 0.0),
        )
        return replace(device, law=values)

    def left(x: Array) -> Array:
        error = _displacements(with_values(x), records, real, steps) - wanted
        return np.clip(np.nan_to_num(error / np.std(wanted), nan=1e3), -1e3, 1e3)

    first = np.zeros(4 if bench.cubic_known else 3)
    found = least_squares(left, first, x_scale=0.1, diff_step=1e-4, ftol=1e-4, xtol=1e-6, max_nfev=FITS)
    return with_values(found.x)


def _displacements(device: Device, records: tuple[Record, ...], real: list[Readings], steps: int) -> Array:
    pairs = zip(records, real, strict=True)
    runs = [simulate(device, record, (), steps, readings.fine) for record, readings in pairs]
    return np.concatenate([readings.displacement for readings in runs])
