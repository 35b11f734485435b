"""Draws what is hidden in a sputtered cantilever, and makes it as large as wished, as `foreign_grain_sizes` does.

The share of an effect is what remains after a re-fit: of ln(resistance) or of the deflection, whichever is more, RMS
error over standard deviation on the fit records. Fitted are the time constant, the current's gain, and a factor and a
constant of either reading; the loops are the true ones.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from foreign_common import Array, log_uniform
from foreign_device import Effect
from foreign_grain_sizes import (
    NUDGE,
    READINGS,
    Plan,
    Shares,
    as_wished,
    beyond_factors,
    both,
    case_of,
    middling,
    names_in_turn,
)
from foreign_kept_cantilever_device import CantileverDevice, simulate
from foreign_kept_cantilever_styles import KIND, LASER_STEP_V, STYLES, Bench, stream
from scipy.optimize import least_squares

FITS = 4  # steps of the re-fit


def draw_names(style: str, seed: int) -> tuple[int, list[str]]:
    """How many effects are hidden (0, 1 or 2), and all of them in the order in which they are tried."""
    key = [KIND, STYLES.index(style)]
    return names_in_turn(seed, [*key, 1], [*key, 2], stream(style, seed, "order"))


def hide(
    bench: Bench, seed: int, plan: Plan, names: tuple[str, ...] | None
) -> tuple[tuple[Effect, ...], list[Shares]]:
    """What is hidden, `names` or what the seed draws if None, and the shares of each."""
    return case_of(names, draw_names(bench.style, seed), lambda name: sized_effect(bench, seed, name, plan))


def sized_effect(
    bench: Bench, seed: int, name: str, plan: Plan, share: float | None = None
) -> tuple[Effect, Shares]:
    """The effect with a drawn (or given) share, and the shares that it reaches; ValueError if no size fits."""
    guess, left = partial(first_guess, bench, name), partial(shares_left, bench.device)
    return as_wished(
        bench.style, seed, name, plan, share, guess=guess, left=left, noise=partial(noise_shares, bench)
    )


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
        made = both([simulate(trial, current) for current in currents])
        return (beyond_factors(real, made) / spread).ravel("F")

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
    sign, quality = float(rng.choice([-1.0, 1.0])), log_uniform(rng, 5.0, 60.0)
    drift: dict[str, float | str] = {"form": str(rng.choice(["linear", "cosine"])), "sign": sign}
    age: dict[str, float | str] = {"bend": log_uniform(rng, 0.3, 8.0), "sign": sign}
    form: dict[str, float | str] = {"form": str(rng.choice(["zero", "hold"]))}
    slow: dict[str, float | str] = {"tau2_s": device.tau_s * log_uniform(rng, 4.0, 30.0)}
    values = {
        "thermal.second_time_constant": slow,
        "thermal.ambient_drift": drift,
        "actuation.deadband": form,
        "sensor.ageing": age,
        "structure.resonance": {"quality": quality},
    }
    per_mA = device.film.metal / bench.high_mA
    return middling(name, values, device.tau_s, device.period_s, span_mA, per_mA)
