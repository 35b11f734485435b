"""Draws what is hidden in an oscillator of `foreign_response_styles`, and makes it as large as wished.

The share of an effect is what a re-fit of the user's own model leaves: RMS error over RMS of the readings about their
mean, in free runs of all records that are not for tests (of two at most), the first state known
(of an accelerometer: at rest at zero, unless the base moves).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
from foreign_common import Array, log_uniform, search_size
from foreign_oscillator_device import EFFECTS, Device, Effect, changed_law, natural_square, steps_of
from foreign_oscillator_guesses import first_guess
from foreign_oscillator_motion import Law
from foreign_oscillator_sizes import LINEAR, case_of
from foreign_oscillator_styles import AnyBench
from foreign_response_device import Response, simulate
from foreign_response_styles import ResponseBench, draw_bench
from scipy.optimize import least_squares

SMALLEST, LARGEST = 0.03, 0.30  # share of the readings
ABOVE_NOISE = 3.0  # a share is at least so many times the noise
COMPARED = 2  # records
FITS = 5  # steps of the re-fit
EXPONENTS = (0.3, 0.7, 1.6, 2.5)


@cache
def hide(
    style: str, seed: int, names: tuple[str, ...]
) -> tuple[ResponseBench, tuple[Effect, ...], tuple[float, ...]]:
    """The bench with these effects in sizes of the seed; ValueError for one that has no size that can be seen."""
    bench = draw_bench(style, seed, linear=bool(LINEAR & set(names)))
    return case_of(bench, seed, names, sized_effect, share_left)


def sized_effect(
    bench: ResponseBench, seed: int, name: str, share: float | None = None
) -> tuple[Effect, float]:
    """The effect with a drawn (or given) share, and the share that it reaches."""
    step_s = bench.device.period_s / steps_of(bench.device, bench.device.law)
    return as_wished(bench, seed, name, share, guess, share_left, step_s)


def as_wished(
    bench: AnyBench,
    seed: int,
    name: str,
    share: float | None,
    guess: Callable[[AnyBench, str, np.random.Generator], tuple[Effect, float, float]],
    left: Callable[[AnyBench, tuple[Effect, ...]], float],
    step_s: float,
) -> tuple[Effect, float]:
    """The effect with a drawn (or given) share, and the share that it reaches; ValueError if no size fits.

    `guess`: a middling size with its smallest and largest; `left`: the share of these effects; a delay is of whole
    steps of `step_s`.
    """
    if name not in EFFECTS:
        raise ValueError(f"effect must be one of {', '.join(EFFECTS)}, got {name!r}")
    rng = np.random.default_rng([*map(ord, bench.style), seed, list(EFFECTS).index(name)])
    noise = float(np.hypot(bench.white, bench.flicker))
    wanted = share or max(log_uniform(rng, 0.035, 0.27), 1.2 * ABOVE_NOISE * noise)
    effect, low, high = guess(bench, name, rng)

    def reached(size: float) -> float:
        return left(bench, (replace(effect, size=size),))

    size = effect.size if low == high else search_size(reached, effect.size, low, high, wanted)
    if name == "drive.delay":
        size = max(round(size / step_s), 1) * step_s
    seen = reached(size)
    if not max(SMALLEST, ABOVE_NOISE * noise) <= seen <= LARGEST:
        raise ValueError(f"{name} on {bench.style} {seed}: no size from {low:.3g} to {high:.3g} fits")
    return replace(effect, size=size), seen


def guess(bench: ResponseBench, name: str, rng: np.random.Generator) -> tuple[Effect, float, float]:
    """A middling size with its smallest and largest; those of a sensor are in the reading's unit (of the law)."""
    effect, low, high = first_guess(bench, name, rng)
    values = dict(effect.values)
    if name == "damping.power":
        exponent = float(rng.choice(EXPONENTS))
        w = float(np.sqrt(natural_square(bench.device.law)))
        ratio = (w * bench.largest) ** (values["exponent"] - exponent)  # one speed, one force
        values["exponent"], low, high = exponent, low * ratio, high * ratio
        z = bench.displacement_unit
        unit = f"{z}^{1 - exponent:g}*s^{exponent - 2:g}"
        effect = replace(effect, size=effect.size * ratio, unit=unit)
    if name.startswith("sensor.") and effect.unit == bench.displacement_unit:
        ratio = bench.reading_largest / bench.largest
        low, high = low * ratio, high * ratio
        effect = replace(effect, size=effect.size * ratio, unit=law_unit(bench))
    if name == "sensor.saturation":
        values["A"] = bench.reading_largest
    return replace(effect, values=values), low, high


def law_unit(bench: ResponseBench) -> str:
    """Unit of the readings that belongs to the law's z."""
    return bench.displacement_unit + ("/s^2" if bench.response == "acceleration" else "")


def fitted_law(law: Law, x: Array, quality: float, per_cubic: float) -> Law:
    """The law with changes of damping, stiffness (in line widths), gain and, if there is a fourth, cubic stiffness."""
    return law._replace(
        damping=law.damping * (1.0 + x[0]),
        stiffness=law.stiffness * (1.0 + x[1] / quality),
        gain=law.gain * (1.0 + x[2]),
        cubic=law.cubic + (x[3] * per_cubic if x.size > 3 else 0.0),
    )


def share_left(bench: ResponseBench, effects: tuple[Effect, ...]) -> float:
    """RMS of what a re-fit of the user's model leaves, over the RMS of the readings about their mean."""
    device = bench.device
    records = tuple(record for record in bench.records if record.use != "test")[:COMPARED]
    steps = steps_of(device, changed_law(device.law, effects))
    real = [simulate(device, record, bench.response, effects, steps) for record in records]
    wanted = np.concatenate([readings.reading for readings in real])
    if bench.response == "acceleration" and not any(effect.id == "base.motion" for effect in effects):
        real = [r._replace(start=(0.0, 0.0)) for r in real]  # nobody knows that a constant force has moved it
    if not np.isfinite(wanted).all():
        return inf
    law, per_cubic = device.law, natural_square(device.law) / bench.largest**2
    spread = float(np.std(wanted))

    def left(x: Array) -> Array:
        values = fitted_law(law, x, bench.quality, per_cubic)
        error = _readings(replace(device, law=values), bench, real, steps) - wanted
        return np.clip(np.nan_to_num(error / spread, nan=1e3), -1e3, 1e3)

    first = np.zeros(4 if bench.cubic_known else 3)
    found = least_squares(left, first, x_scale=0.1, diff_step=1e-4, ftol=1e-3, xtol=1e-5, max_nfev=FITS)
    return float(np.sqrt(np.mean(found.fun**2)))


def _readings(device: Device, bench: ResponseBench, real: list[Response], steps: int) -> Array:
    records = [record for record in bench.records if record.use != "test"]
    runs = [
        simulate(device, record, bench.response, (), steps, readings.start)
        for record, readings in zip(records, real, strict=False)
    ]
    return np.concatenate([run.reading for run in runs])
