"""Currents of fit and test records: fast against 1.8 ms, slow enough to cross the transition many times."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import sawtooth

from .physics import FloatArray

REST_S = 0.03
KINDS = ("telegraph", "multisine", "steps", "sweep", "ramps")


class Band:
    """Where the currents of a record lie, mA."""

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def at(self, part: FloatArray) -> FloatArray:
        """0..1 -> current, even in its square: even in temperature."""
        return np.sqrt(self.low**2 + np.clip(part, 0.0, 1.0) * (self.high**2 - self.low**2))


def excite(
    rng: np.random.Generator, kind: str, samples: int, rate_Hz: float, band: Band, lowest: float, pace: float
) -> FloatArray:
    """One record's current [mA]: 30 ms of the lowest current, then the excitation; `pace` > 1 is faster."""
    rest = int(REST_S * rate_Hz)
    part = _KINDS[kind](rng, samples - rest, rate_Hz, pace)
    current = np.concatenate([np.full(rest, lowest), band.at(part)])
    return np.round(current, 4)


def _hold(levels: FloatArray, dwell_s: FloatArray, samples: int, rate_Hz: float) -> FloatArray:
    lengths = np.maximum(1, np.round(dwell_s * rate_Hz)).astype(np.int64)
    return np.resize(np.repeat(levels, lengths), samples)


def _telegraph(rng: np.random.Generator, samples: int, rate_Hz: float, pace: float) -> FloatArray:
    count = int(samples / rate_Hz / 0.002 * pace) + 10
    levels = rng.uniform(0.0, 1.0, int(rng.integers(4, 12)))
    levels[:2] = [0.0, 1.0]
    return _hold(rng.choice(levels, count), (rng.exponential(0.008, count) + 0.002) / pace, samples, rate_Hz)


def _steps(rng: np.random.Generator, samples: int, rate_Hz: float, pace: float) -> FloatArray:
    count = int(samples / rate_Hz / 0.03 * pace) + 10
    return _hold(rng.uniform(0.0, 1.0, count), rng.uniform(0.03, 0.15, count) / pace, samples, rate_Hz)


def _multisine(rng: np.random.Generator, samples: int, rate_Hz: float, pace: float) -> FloatArray:
    top = rng.uniform(40.0, 140.0) * pace
    frequency = np.exp(rng.uniform(np.log(0.7), np.log(min(top, 0.3 * rate_Hz)), 40))
    phase = rng.uniform(0.0, 2 * np.pi, 40)
    strength = frequency ** -rng.uniform(0.0, 0.5)
    t = np.arange(samples) / rate_Hz
    u = np.sin(2 * np.pi * t[:, None] * frequency + phase) @ strength
    return 0.5 + rng.uniform(0.22, 0.32) * u / u.std()


def _sweep(rng: np.random.Generator, samples: int, rate_Hz: float, pace: float) -> FloatArray:
    t = np.arange(samples) / rate_Hz
    low, high = rng.uniform(0.5, 2.0) * pace, min(rng.uniform(60.0, 160.0) * pace, 0.3 * rate_Hz)
    turn = np.log(high / low) / t[-1]
    sign = rng.choice([-1.0, 1.0])
    phase = 2 * np.pi * low * np.expm1(turn * t) / turn
    return 0.5 - 0.5 * np.cos(phase if sign > 0 else phase[-1] - phase)


def _ramps(rng: np.random.Generator, samples: int, rate_Hz: float, pace: float) -> FloatArray:
    """Triangles whose amplitude and centre wander: minor loops at several rates."""
    t = np.arange(samples) / rate_Hz
    frequency = rng.uniform(3.0, 25.0) * pace
    slow = rng.uniform(0.3, 1.0) * pace
    depth = 0.3 + 0.2 * np.sin(2 * np.pi * slow * t + rng.uniform(0, 6.28))
    centre = 0.5 + 0.2 * np.sin(2 * np.pi * 1.7 * slow * t)
    return centre + depth * sawtooth(2 * np.pi * frequency * t, 0.5)


_KINDS: dict[str, Callable[[np.random.Generator, int, float, float], FloatArray]] = {
    "telegraph": _telegraph,
    "multisine": _multisine,
    "steps": _steps,
    "sweep": _sweep,
    "ramps": _ramps,
}
