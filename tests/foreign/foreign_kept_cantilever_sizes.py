"""Draws what is hidden in a sputtered cantilever, and makes it as large as wished, as `foreign_grain_sizes` does.

The share of an effect is what remains after a re-fit: of ln(resistance) or of the deflection, whichever is more, RMS
error over standard deviation on the fit records. Fitted are the time constant, the current's gain, and a factor and a
constant of either reading; the loops are the true ones.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from foreign_common import Array, log_uniform, search_size
from foreign_device import EFFECTS, Effect
from foreign_grain_sizes import ABOVE_NOISE, BLOCK, LARGEST, NUDGE, READINGS, SMALLEST, both
from foreign_kept_cantilever_device import CantileverDevice, simulate
from foreign_kept_cantilever_styles import KIND, LASER_STEP_V, STYLES, Bench, stream
from scipy.optimize import least_squares

FITS = 4  # steps of the re-fit
Plan = list[tuple[str, str, Array]]


def draw_names(style: str, seed: int) -> tuple[int, list[str]]:
    """How many effects are hidden (0, 1 or 2), and all of them in the order in which they are tried.

    In each block of six seeds one place, by the seed, has none and one two; single effects go round in turn.
    """
    block, place = divmod(seed, BLOCK)
    key = [KIND, STYLES.index(style)]
    counts = np.random.default_rng([*key, 1, block]).permutation([0, 1, 1, 1, 1, 2])
    names, count = list(EFFECTS), int(counts[place])
    if count != 1:
        return count, [str(name) for name in stream(style, seed, "order").permutation(names)]
    order = np.random.default_rng([*key, 2]).permutation(len(names))
    number = 4 * block + int(np.sum(counts[:place] == 1))
    return count, [names[order[(number + k) % len(names)]] for k in range(len(names))]


def draw_case(bench: Bench, seed: int, plan: Plan) -> tuple[tuple[Effect, ...], list[dict[str, float]]]:
    """What is hidden, and the shares of each; an effect that cannot be seen on this bench is passed over."""
    count, tried = draw_names(bench.style, seed)
    chosen: list[tuple[Effect, dict[str, float]]] = []
    for name in tried:
        if len(chosen) == count:
            break
        if any(name.split(".")[0] == effect.id.split(".")[0] for effect, _ in chosen):
            continue
        try:
            chosen.append(sized_effect(bench, seed, name, plan))
        except ValueError:
            continue
    return tuple(effect for effect, _ in chosen), [shares for _, shares in chosen]


def sized_effect(
    bench: Bench, seed: int, name: str, plan: Plan, share: float | None = None
) -> tuple[Effect, dict[str, float]]:
    """The effect with a drawn (or given) share, and the shares that it reaches; ValueError if no size fits."""
    if name not in EFFECTS:
        raise ValueError(f"effect must be one of {', '.join(EFFECTS)}, got {name!r}")
    rng = np.random.default_rng([*map(ord, bench.style), seed, list(EFFECTS).index(name)])
    currents = [current for _, use, current in plan if use == "fit"]
    wanted = share or log_uniform(rng, 0.035, 0.25)
    effect, low, high = first_guess(bench, name, rng, max(current.size for current in currents))
    reached: dict[float, dict[str, float]] = {}

    def largest(size: float) -> float:
        reached[size] = shares_left(bench.device, currents, (replace(effect, size=size),))
        return max(reached[size].values())

    size = search_size(largest, effect.size, low, high, wanted)
    shares, noise = reached[size], noise_shares(bench, currents)
    seen = max(shares[reading] / max(SMALLEST, ABOVE_NOISE * noise[reading]) for reading in READINGS)
    if seen < 1.0 or max(shares.values()) > LARGEST:
        raise ValueError(f"{name} on {bench.style} {seed}: no size from {low:.3g} to {high:.3g} fits")
    return replace(effect, size=size), shares


def noise_shares(bench: Bench, currents: list[Array]) -> dict[str, float]:
    """RMS of each reading's noise over its standard deviation."""
    clean = both([simulate(bench.device, current) for current in currents])
    spread, ohm = np.std(clean, axis=0), np.exp(clean[:, 0])
    step = 1e3 * bench.volts / bench.counts / bench.sense_mA  # ohm
    white = np.hypot(bench.resistance_noise_ohm, step / np.sqrt(12.0)) / ohm
    step = LASER_STEP_V * bench.um_per_V
    return {
        "resistance": float(np.sqrt(np.mean(white**2) + bench.resistance_flicker**2) / spread[0]),
        "deflection": float(np.hypot(bench.deflection_noise_um, step / np.sqrt(12.0)) / spread[1]),
    }


def shares_left(
    device: CantileverDevice,
    currents: list[Array],
    effects: tuple[Effect, ...],
    nominal: CantileverDevice | None = None,
) -> dict[str, float]:
    """RMS that a re-fit of the device leaves over the standard deviation, of ln(resistance) and the deflection.

    `nominal`: another device to fit with, if not the same without effects.
    """
    real, base = both([simulate(device, current, effects) for current in currents]), nominal or device
    spread = np.std(real, axis=0)

    def left(x: Array) -> Array:
        tau, gain = base.tau_s * float(np.exp(x[0])), base.gain_C_per_mA2 * float(np.exp(x[1]))
        trial = replace(base, tau_s=tau, gain_C_per_mA2=gain)
        made, columns = both([simulate(trial, current) for current in currents]), []
        for k in range(2):
            of = np.column_stack([made[:, k], np.ones(made.shape[0])])
            columns.append((real[:, k] - of @ np.linalg.lstsq(of, real[:, k], rcond=None)[0]) / spread[k])
        return np.concatenate(columns)

    found = least_squares(
        left, np.zeros(2), bounds=(-1.5, 1.5), diff_step=[NUDGE] * 2, max_nfev=FITS, ftol=1e-3
    )
    rms = np.sqrt(np.mean(found.fun.reshape(2, -1) ** 2, axis=1))
    return dict(zip(READINGS, rms.tolist(), strict=True))


def first_guess(
    bench: Bench, name: str, rng: np.random.Generator, samples: int
) -> tuple[Effect, float, float]:
    """An effect of a middling size, its smallest and its largest, in its unit."""
    device, span_mA = bench.device, bench.high_mA - bench.low_mA
    tau, period, per_mA = device.tau_s, device.period_s, device.film.metal / bench.high_mA
    sign, quality = float(rng.choice([-1.0, 1.0])), log_uniform(rng, 5.0, 60.0)
    drift: dict[str, float | str] = {"form": str(rng.choice(["linear", "cosine"])), "sign": sign}
    age: dict[str, float | str] = {"bend": log_uniform(rng, 0.3, 8.0), "sign": sign}
    form: dict[str, float | str] = {"form": str(rng.choice(["zero", "hold"]))}
    slow: dict[str, float | str] = {"tau2_s": tau * log_uniform(rng, 4.0, 30.0)}
    known: dict[str, tuple[str, float, float, float, dict[str, float | str]]] = {
        "thermal.second_time_constant": ("1", 0.1, 1e-3, 0.6, slow),
        "thermal.latent_heat": ("K", 8.0, 0.05, 80.0, {}),
        "thermal.ambient_drift": ("K", 1.0, 1e-2, 15.0, drift),
        "heater.tcr": ("1/K", 4e-4, 1e-6, 4.5e-3, {}),
        "actuation.delay": ("s", 0.3 * tau, 0.02 * tau, 5.0 * tau, {}),
        "actuation.deadband": ("mA", 0.02 * span_mA, 1e-4 * span_mA, 0.4 * span_mA, form),
        "hysteresis.rate_dependence": ("s", 0.3 * tau, 0.01 * tau, 5.0 * tau, {}),
        "hysteresis.creep": ("1", 0.1, 1e-3, 0.7, {}),
        "sensor.self_heating": ("K", 1.0, 1e-2, 10.0, {}),
        "sensor.lag": ("s", 0.3 * tau, 0.01 * tau, 5.0 * tau, {}),
        "sensor.ageing": ("1", 0.1, 1e-3, 0.4, age),
        "sensor.crosstalk": ("ohm/mA", 0.1 * per_mA, 1e-4 * per_mA, 2.0 * per_mA, {}),
        "structure.resonance": ("s", 3.0 * period, 1.5 * period, 40.0 * period, {"quality": quality}),
    }
    unit, start, low, high, values = known[name]
    return Effect(id=name, size=start, unit=unit, values=values), low, high
