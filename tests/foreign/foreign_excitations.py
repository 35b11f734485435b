"""Currents [mA] that a lab sends: staircases to identify with, and moving records."""

from __future__ import annotations

import numpy as np
from foreign_loops import Array
from foreign_styles import Bench, stream


def records(bench: Bench, seed: int) -> list[tuple[str, str, Array]]:
    """Name, use and current [mA] of each record: one staircase, three to fit, one to test."""
    rng = stream(bench.style, seed, "records")
    tau = bench.device.tau_s / bench.device.period_s  # samples
    samples = int(np.clip(400.0 * tau, rng.uniform(3000, 5000), 6000))
    half = samples // 2
    return [
        ("staircase", "identify", np.repeat(_staircase(bench, rng), bench.hold_samples)),
        ("steps", "fit", random_steps(bench, samples, tau, rng)),
        ("multisine", "fit", multisine(bench, samples, tau, rng)),
        ("ramps", "fit", ramps(bench, samples, tau, rng)),
        ("test", "test", np.concatenate([random_steps(bench, half, tau, rng), ramps(bench, half, tau, rng)])),
    ]


def _staircase(bench: Bench, rng: np.random.Generator) -> Array:
    """Levels [mA] of the identification, as each style's lab would choose them."""
    if bench.style == "many_domains":
        return _major_and_minor(bench, 60, rng)
    if bench.style == "thick_film":
        return _first_order_reversals(bench, 30, 7)
    return damped_oscillation(bench, int(rng.integers(180, 300)), float(rng.uniform(0.82, 0.9)))


def damped_oscillation(bench: Bench, levels: int, decay: float) -> Array:
    """Up and down around the transition, each swing smaller; as many levels a swing as it is long."""
    ends = [bench.low_mA]
    for k in range(16):
        side = bench.high_mA if k % 2 == 0 else bench.low_mA
        ends.append(bench.centre_mA + (side - bench.centre_mA) * decay**k)
    return _walk(ends, np.abs(np.diff(ends)).sum() / levels)


def _major_and_minor(bench: Bench, levels: int, rng: np.random.Generator) -> Array:
    """A major loop of so many levels each way, then minor loops inside it."""
    ends = [bench.low_mA, bench.high_mA, bench.low_mA]
    span = bench.high_mA - bench.low_mA
    for _ in range(int(rng.integers(4, 7))):
        low, high = np.sort(bench.centre_mA + span * rng.uniform(-0.22, 0.22, 2))
        ends += [high, low, high, low]
    return _walk(ends, span / levels)


def _first_order_reversals(bench: Bench, levels: int, curves: int) -> Array:
    """A major loop, then from the hot end down to each reversal and up again."""
    span = bench.high_mA - bench.low_mA
    ends = [bench.low_mA, bench.high_mA]
    for reversal in np.linspace(bench.low_mA, bench.centre_mA + 0.15 * span, curves):
        ends += [float(reversal), bench.high_mA]
    return _walk(ends, span / levels)


def _walk(ends: list[float], step: float) -> Array:
    """Levels from end to end, about `step` apart."""
    parts = [np.array(ends[:1])]
    for start, stop in zip(ends, ends[1:], strict=False):
        parts.append(np.linspace(start, stop, max(round(abs(stop - start) / step), 1) + 1)[1:])
    return np.concatenate(parts)


def random_steps(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Random levels of the whole range, each for 1 to 20 time constants."""
    current = np.empty(0)
    while current.size < samples:
        length = max(round(tau * float(np.exp(rng.uniform(0.0, np.log(20.0))))), 1)
        current = np.append(current, np.full(length, rng.uniform(bench.low_mA, bench.high_mA)))
    return current[:samples]


def multisine(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Eight lines about a bias in the transition, from 0.003 to 0.15 cycles a time constant."""
    cycles = np.geomspace(0.003, 0.15, 8) * rng.uniform(0.9, 1.1, 8) / tau
    phases = 2.0 * np.pi * (np.outer(np.arange(samples), cycles) + rng.random(8))
    wave = np.sin(phases).sum(axis=1)
    wave /= np.abs(wave).max()
    room = min(bench.high_mA - bench.centre_mA, bench.centre_mA - bench.low_mA)
    return bench.centre_mA + rng.uniform(0.5, 0.98) * room * wave


def ramps(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Straight lines between random levels, each of 8 to 60 time constants."""
    times, levels = [0.0], [bench.low_mA]
    while times[-1] < samples:
        times.append(times[-1] + tau * float(np.exp(rng.uniform(np.log(8.0), np.log(60.0)))))
        levels.append(float(rng.uniform(bench.low_mA, bench.high_mA)))
    return np.interp(np.arange(samples), times, levels)
