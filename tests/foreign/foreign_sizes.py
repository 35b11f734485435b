"""Draws a hidden effect and makes it as large as wished: the share of the readings' variation it changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from foreign_common import log_uniform, search_size
from foreign_device import EFFECTS, Effect, Readings, simulate
from foreign_loops import Array
from foreign_styles import STYLES, Bench, stream

SMALLEST, LARGEST = 0.01, 0.20  # share of the variation


def draw_id(style: str, seed: int) -> str | None:
    """None for one seed in four, else an effect; all come equally often, in an order of the style's own.

    That holds for seeds one after the other, and for every fourth (styles in turn): steps of 1 and of 5 below.
    """
    number = STYLES.index(style)
    place = seed + seed // 4
    if place % 4 == 3:
        return None
    order = np.random.default_rng([number, 2002]).permutation(len(EFFECTS))
    return list(EFFECTS)[order[place % len(EFFECTS)]]


def share_changed(without: list[Readings], with_it: list[Readings]) -> dict[str, float]:
    """RMS change over standard deviation, of ln(resistance) and of the deflection; all records together."""
    shares = {}
    for name in ("resistance", "deflection"):
        before = np.concatenate([getattr(reading, name) for reading in without])
        after = np.concatenate([getattr(reading, name) for reading in with_it])
        if name == "resistance":
            before, after = np.log(before), np.log(after)
        shares[name] = float(np.sqrt(np.mean((after - before) ** 2)) / np.std(before))
    return shares


def sized_effect(
    bench: Bench, seed: int, effect_id: str, currents: list[Array], share: float | None = None
) -> tuple[Effect, dict[str, float]]:
    """The effect with a drawn (or given) larger share of the two readings, and the shares that it reaches."""
    if effect_id not in EFFECTS:
        raise ValueError(f"effect must be one of {', '.join(EFFECTS)}, got {effect_id!r}")
    rng = stream(bench.style, seed, "effect")
    wanted = share or log_uniform(rng, 0.02, 0.15)
    effect, low, high = _start(bench, effect_id, rng, max(current.size for current in currents))
    without = [simulate(bench.device, current) for current in currents]

    def reached(size: float) -> dict[str, float]:
        acting = replace(effect, size=size)
        return share_changed(without, [simulate(bench.device, c, acting) for c in currents])

    size = search_size(lambda size: max(reached(size).values()), effect.size, low, high, wanted)
    shares = reached(size)
    if not SMALLEST <= max(shares.values()) <= LARGEST:
        raise RuntimeError(f"{effect_id} on {bench.style} {seed}: no size from {low:.3g} to {high:.3g} fits")
    return replace(effect, size=size), shares


def _start(
    bench: Bench, effect_id: str, rng: np.random.Generator, samples: int
) -> tuple[Effect, float, float]:
    """An effect of a middling size with its smallest and largest, in its unit."""
    device, span_mA = bench.device, bench.high_mA - bench.low_mA
    tau, period, duration = device.tau_s, device.period_s, samples * device.period_s
    cold = float(device.resistance(device.ambient_C, 0.0))
    drift = {"settling_s": duration * float(rng.uniform(0.3, 1.5)), "sign": float(rng.choice([-1.0, 1.0]))}
    quality = log_uniform(rng, 4.0, 30.0)
    form = str(rng.choice(["zero", "hold"]))
    unit, start, low, high, values = {
        "thermal.second_time_constant": ("1", 0.1, 1e-3, 0.6, {"tau2_s": tau * log_uniform(rng, 4.0, 30.0)}),
        "thermal.latent_heat": ("K", 8.0, 0.05, 80.0, {}),
        "thermal.ambient_drift": ("K", 1.0, 1e-2, 20.0, drift),
        "heater.tcr": ("1/K", 4e-4, 1e-6, 6e-3, {}),
        "actuation.delay": ("s", 0.3 * tau, 1e-3 * tau, 5.0 * tau, {}),
        "actuation.deadband": ("mA", 0.02 * span_mA, 1e-4 * span_mA, 0.4 * span_mA, {"form": form}),
        "hysteresis.rate_dependence": ("s", 0.3 * tau, 1e-3 * tau, 5.0 * tau, {}),
        "hysteresis.creep": ("1", 0.1, 1e-3, 0.7, {}),
        "sensor.self_heating": ("K", 1.0, 1e-2, 20.0, {}),
        "sensor.lag": ("s", 0.3 * tau, 1e-3 * tau, 5.0 * tau, {}),
        "sensor.ageing": ("1", 0.1, 1e-3, 1.0, {"exponent": float(rng.uniform(0.5, 1.0))}),
        "sensor.crosstalk": (
            "ohm/mA",
            0.1 * device.metal_ohm / bench.high_mA,
            1e-4 * device.metal_ohm / bench.high_mA,
            cold / bench.high_mA,
            {},
        ),
        "structure.resonance": ("s", 2.0 * period, 0.75 * period, 60.0 * period, {"quality": quality}),
    }[effect_id]
    return Effect(id=effect_id, size=start, unit=unit, values=values), low, high
