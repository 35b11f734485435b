"""Draws what is hidden in a film of grains, and makes it as large as wished.

The share of an effect is what remains after a re-fit: of ln(resistance) or of the deflection, whichever is more, RMS
error over standard deviation on the fit records. Fitted are the time constant, the current's gain, and a factor and a
constant of either reading; the loops are the true ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from foreign_common import Array, log_uniform, search_size
from foreign_device import EFFECTS, Effect, Readings
from foreign_grain_device import GrainDevice, simulate
from foreign_grain_styles import STYLES, Bench, stream

SMALLEST, LARGEST = 0.03, 0.30  # share of the variation
ABOVE_NOISE = 3.0  # a share is at least so many times the noise of its reading
BLOCK = 6  # seeds: one has nothing hidden, four one effect, one two
FITS = 3  # steps of the re-fit
NUDGE = 0.03  # of a logarithm, for its derivatives
AT_REST = {
    "heater.tcr",
    "actuation.deadband",
    "sensor.crosstalk",
    "sensor.self_heating",
}  # a staircase holds them
READINGS = ("resistance", "deflection")
Plan = list[tuple[str, str, Array]]  # name, use and current [mA] of each record
Shares = dict[str, float]  # of each reading


def draw_names(style: str, seed: int) -> tuple[int, list[str]]:
    """How many effects are hidden (0, 1 or 2), and all of them in the order in which they are tried."""
    number = STYLES.index(style)
    return names_in_turn(seed, [number, 5005], [number, 5006], stream(style, seed, "order"))


def names_in_turn(
    seed: int, of_counts: list[int], of_order: list[int], rng: np.random.Generator
) -> tuple[int, list[str]]:
    """How many effects are hidden (0, 1 or 2), and all of them in the order in which they are tried.

    In each block of six seeds one place, by the seed, has none and one two; single effects go round in turn.
    `of_counts`, `of_order`: keys of the style's streams; `rng` shuffles what does not go round.
    """
    block, place = divmod(seed, BLOCK)
    counts = np.random.default_rng([*of_counts, block]).permutation([0, 1, 1, 1, 1, 2])
    names, count = list(EFFECTS), int(counts[place])
    if count != 1:
        return count, [str(name) for name in rng.permutation(names)]
    order = np.random.default_rng(of_order).permutation(len(names))
    number = 4 * block + int(np.sum(counts[:place] == 1))
    return count, [names[order[(number + k) % len(names)]] for k in range(len(names))]


def hide(
    bench: Bench, seed: int, plan: Plan, names: tuple[str, ...] | None
) -> tuple[tuple[Effect, ...], list[Shares]]:
    """What is hidden, `names` or what the seed draws if None, and the shares of each."""
    return case_of(names, draw_names(bench.style, seed), lambda name: sized_effect(bench, seed, name, plan))


def case_of(
    names: tuple[str, ...] | None,
    drawn: tuple[int, list[str]],
    sized: Callable[[str], tuple[Effect, Shares]],
) -> tuple[tuple[Effect, ...], list[Shares]]:
    """What is hidden, and the shares of each: `names`, or if None as many of those that are `drawn` as they say.

    `sized` raises ValueError where an effect cannot be seen; of those that are drawn it is passed over.
    """
    if names is not None:
        chosen = [sized(name) for name in names]
        return tuple(effect for effect, _ in chosen), [shares for _, shares in chosen]
    count, tried = drawn
    chosen = []
    for name in tried:
        if len(chosen) == count:
            break
        if any(name.split(".")[0] == effect.id.split(".")[0] for effect, _ in chosen):
            continue
        try:
            chosen.append(sized(name))
        except ValueError:
            continue
    return tuple(effect for effect, _ in chosen), [shares for _, shares in chosen]


def sized_effect(
    bench: Bench, seed: int, name: str, plan: Plan, share: float | None = None
) -> tuple[Effect, Shares]:
    """The effect with a drawn (or given) share, and the shares that it reaches; ValueError if no size fits."""
    return as_wished(
        bench.style,
        seed,
        name,
        plan,
        share,
        guess=partial(first_guess, bench, name),
        left=partial(shares_left, bench.device),
        noise=partial(noise_shares, bench),
    )


def as_wished(
    style: str,
    seed: int,
    name: str,
    plan: Plan,
    share: float | None,
    *,
    guess: Callable[[np.random.Generator, int], tuple[Effect, float, float]],
    left: Callable[[list[Array], tuple[Effect, ...]], Shares],
    noise: Callable[[list[Array]], Shares],
) -> tuple[Effect, Shares]:
    """The effect with a drawn (or given) share, and the shares that it reaches; ValueError if no size fits.

    Of the fit records' currents: `guess` makes an effect of the longest one's samples, with its smallest and largest
    size; `left` is what a re-fit leaves of the effects, `noise` what the instruments do.
    """
    if name not in EFFECTS:
        raise ValueError(f"effect must be one of {', '.join(EFFECTS)}, got {name!r}")
    rng = np.random.default_rng([*map(ord, style), seed, list(EFFECTS).index(name)])
    currents = [current for _, use, current in plan if use == "fit"]
    wanted = share or log_uniform(rng, 0.035, 0.25)
    effect, low, high = guess(rng, max(current.size for current in currents))
    reached: dict[float, Shares] = {}

    def largest(size: float) -> float:
        reached[size] = left(currents, (replace(effect, size=size),))
        return max(reached[size].values())

    size = search_size(largest, effect.size, low, high, wanted)
    shares, least = reached[size], noise(currents)
    seen = max(shares[reading] / max(SMALLEST, ABOVE_NOISE * least[reading]) for reading in READINGS)
    if seen < 1.0 or max(shares.values()) > LARGEST:
        raise ValueError(f"{name} on {style} {seed}: no size from {low:.3g} to {high:.3g} fits")
    return replace(effect, size=size), shares


def both(readings: list[Readings]) -> Array:
    """ln(resistance) and deflection of all records, one column each."""
    return np.concatenate([np.column_stack([np.log(r.resistance), r.deflection]) for r in readings])


def noise_shares(bench: Bench, currents: list[Array]) -> dict[str, float]:
    """RMS of each reading's noise over its standard deviation."""
    spread = np.std(both([simulate(bench.device, current) for current in currents]), axis=0)
    resistance = np.hypot(bench.resistance_noise, bench.resistance_flicker)
    deflection = [
        bench.deflection_noise_um,
        bench.deflection_flicker_um,
        bench.deflection_step_um / np.sqrt(12.0),
    ]
    return {
        "resistance": float(resistance / spread[0]),
        "deflection": float(np.linalg.norm(deflection) / spread[1]),
    }


def beyond_factors(real: Array, made: Array) -> Array:
    """What a factor and a constant of each column of `made` leave of `real`."""
    columns = []
    for k in range(2):
        of = np.column_stack([made[:, k], np.ones(made.shape[0])])
        columns.append(real[:, k] - of @ np.linalg.lstsq(of, real[:, k], rcond=None)[0])
    return np.column_stack(columns)


def shares_left(
    device: GrainDevice,
    currents: list[Array],
    effects: tuple[Effect, ...],
    nominal: GrainDevice | None = None,
) -> dict[str, float]:
    """RMS that a re-fit of the device leaves over the standard deviation, of ln(resistance) and the deflection.

    `nominal`: another device to fit with, if not the same without effects.
    """
    real = both([simulate(device, current, effects) for current in currents])
    spread, base = np.std(real, axis=0), nominal or device

    def left(x: Array) -> Array:
        tau = base.tau_s * float(np.exp(x[0]))
        layer = min(base.layer_s, 0.9 * tau)
        trial = replace(
            base, tau_s=tau, layer_s=layer, gain_C_per_mA2=base.gain_C_per_mA2 * float(np.exp(x[1]))
        )
        return beyond_factors(real, both([simulate(trial, current) for current in currents])) / spread

    x = np.zeros(2)
    best = left(x)
    for _ in range(FITS):
        slopes = [(left(x + NUDGE * unit) - best).ravel() / NUDGE for unit in np.eye(2)]
        change = np.linalg.lstsq(np.column_stack(slopes), -best.ravel(), rcond=None)[0]
        step = np.clip(change, -0.7, 0.7)
        trial = left(x + step)
        if np.mean(trial**2) > 0.999 * np.mean(best**2):
            step, trial = 0.3 * step, left(x + 0.3 * step)
        if np.mean(trial**2) > 0.999 * np.mean(best**2):
            break
        x, best = x + step, trial
    return dict(zip(READINGS, np.sqrt(np.mean(best**2, axis=0)).tolist(), strict=True))


def first_guess(
    bench: Bench, name: str, rng: np.random.Generator, samples: int
) -> tuple[Effect, float, float]:
    """An effect of a middling size, its smallest and its largest, in its unit."""
    device, span_mA = bench.device, bench.high_mA - bench.low_mA
    duration = samples * device.period_s
    sign, quality = float(rng.choice([-1.0, 1.0])), log_uniform(rng, 5.0, 60.0)
    drift = {"settling_s": duration * log_uniform(rng, 0.2, 3.0), "sign": sign}
    age = {"start": log_uniform(rng, 0.01, 1.0), "sign": sign}
    form = str(rng.choice(["zero", "hold"]))
    slow = {"tau2_s": device.tau_s * log_uniform(rng, 4.0, 30.0)}
    values = {
        "thermal.second_time_constant": slow,
        "thermal.ambient_drift": drift,
        "actuation.deadband": {"form": form},
        "sensor.ageing": age,
        "structure.resonance": {"quality": quality},
    }
    per_mA = device.film.metal / bench.high_mA
    return middling(name, values, device.tau_s, device.period_s, span_mA, per_mA)


def middling(
    name: str, values: dict[str, dict[str, Any]], tau: float, period: float, span_mA: float, per_mA: float
) -> tuple[Effect, float, float]:
    """An effect of a middling size with its values, if it has any; its smallest and its largest size.

    `tau`, `period` [s]; `span_mA` of the records; `per_mA`: the hot film's resistance over the largest current.
    """
    unit, start, low, high = {
        "thermal.second_time_constant": ("1", 0.1, 1e-3, 0.6),
        "thermal.latent_heat": ("K", 8.0, 0.05, 80.0),
        "thermal.ambient_drift": ("K", 1.0, 1e-2, 15.0),
        "heater.tcr": ("1/K", 4e-4, 1e-6, 4.5e-3),
        "actuation.delay": ("s", 0.3 * tau, 0.02 * tau, 5.0 * tau),
        "actuation.deadband": ("mA", 0.02 * span_mA, 1e-4 * span_mA, 0.4 * span_mA),
        "hysteresis.rate_dependence": ("s", 0.3 * tau, 0.01 * tau, 5.0 * tau),
        "hysteresis.creep": ("1", 0.1, 1e-3, 0.7),
        "sensor.self_heating": ("K", 1.0, 1e-2, 10.0),
        "sensor.lag": ("s", 0.3 * tau, 0.01 * tau, 5.0 * tau),
        "sensor.ageing": ("1", 0.1, 1e-3, 0.4),
        "sensor.crosstalk": ("ohm/mA", 0.1 * per_mA, 1e-4 * per_mA, 2.0 * per_mA),
        "structure.resonance": ("s", 3.0 * period, 1.5 * period, 40.0 * period),
    }[name]
    return Effect(id=name, size=start, unit=unit, values=values.get(name, {})), low, high
