"""Currents [mA] of the two labs with films of grains: staircases with holds of varying length, sweeps, pulses."""

from __future__ import annotations

import numpy as np
from foreign_common import Array
from foreign_grain_styles import Bench, stream


def records(bench: Bench, seed: int) -> list[tuple[str, str, Array]]:
    """Name, use and current [mA] of each record: a staircase, three to fit, one or two to test."""
    rng = stream(bench.style, seed, "records")
    tau = bench.device.tau_s / bench.device.period_s  # samples
    samples = int(np.clip(380.0 * tau, rng.uniform(2400, 3200), 4800))
    half = samples // 2
    mixed = np.concatenate([sweep(bench, half, tau, rng), walk(bench, half, tau, rng)])
    if bench.style == "nanoribbon":
        return [
            ("quasistatic", "identify", reversals(bench, rng)),
            ("walk_1", "fit", walk(bench, samples, tau, rng)),
            ("chirp", "fit", sweep(bench, samples, tau, rng)),
            ("pulses", "fit", pulses(bench, samples, tau, rng)),
            ("mixed", "test", mixed),
        ]
    return [
        ("stufen", "identify", nested(bench, rng)),
        ("treppe_1", "fit", walk(bench, samples, tau, rng)),
        ("treppe_2", "fit", walk(bench, half, tau, rng)),
        ("dreiecke", "fit", triangles(bench, samples, tau, rng)),
        ("treppe_3", "test", walk(bench, half, tau, rng)),
        ("gemischt", "test", mixed),
    ]


def reversals(bench: Bench, rng: np.random.Generator) -> Array:
    """A major loop, then random reversals inside it; levels of uneven spacing, each held 1 to 1.8 times the least."""
    span = bench.high_mA - bench.low_mA
    ends = [bench.low_mA, bench.high_mA, bench.low_mA]
    for side in np.tile([1.0, -1.0], int(rng.integers(4, 6))):
        reach = float(rng.uniform(0.02, 0.5)) * span
        ends.append(float(np.clip(bench.centre_mA + side * reach, bench.low_mA, bench.high_mA)))
    ends += [bench.high_mA, bench.low_mA]
    return _held(ends, span / int(rng.integers(28, 36)), 0.3, bench.hold_samples, 1.8, rng)


def nested(bench: Bench, rng: np.random.Generator) -> Array:
    """A major loop, then loops inside each other about the middle of the transition; holds of 1 to 1.4 times."""
    ends = [bench.low_mA, bench.high_mA, bench.low_mA]
    for part in np.linspace(0.85, 0.15, int(rng.integers(4, 6))):
        ends.append(bench.centre_mA + part * (bench.high_mA - bench.centre_mA))
        ends.append(bench.centre_mA - part * (bench.centre_mA - bench.low_mA))
    return _held(ends, (bench.high_mA - bench.low_mA) / 28.0, 0.0, bench.hold_samples, 1.4, rng)


def _held(
    ends: list[float], step: float, uneven: float, least: int, longest: float, rng: np.random.Generator
) -> Array:
    levels = [np.array(ends[:1])]
    for start, stop in zip(ends, ends[1:], strict=False):
        parts = np.linspace(start, stop, max(round(abs(stop - start) / step), 1) + 1)
        inner = parts[1:-1] + uneven * step * rng.uniform(-0.5, 0.5, parts.size - 2)
        levels += [inner, parts[-1:]]
    every = np.concatenate(levels)
    return np.repeat(every, np.round(least * rng.uniform(1.0, longest, every.size)).astype(int))


def walk(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """A staircase that goes by random strides, now up, now down, with holds of 0.6 to 25 time constants."""
    span, level, current = bench.high_mA - bench.low_mA, bench.low_mA, np.empty(0)
    while current.size < samples:
        level += float(rng.choice([-1.0, 1.0])) * span * float(rng.beta(1.2, 2.0))
        if not bench.low_mA <= level <= bench.high_mA:  # a wall throws it back into the range
            level = float(rng.uniform(bench.low_mA, bench.high_mA))
        length = max(round(tau * float(np.exp(rng.uniform(np.log(0.6), np.log(25.0))))), 1)
        current = np.append(current, np.full(length, level))
    return current[:samples]


def sweep(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """A sine about the transition from 0.004 to 0.1 cycles a time constant and, in half of the records, back."""
    low, high = 0.004 / tau, 0.1 * float(rng.uniform(0.7, 1.3)) / tau
    place = np.linspace(0.0, 1.0, samples)
    if rng.random() < 0.5:
        place = 1.0 - np.abs(2.0 * place - 1.0)
    phase = 2.0 * np.pi * np.cumsum(low * (high / low) ** place)
    room = min(bench.high_mA - bench.centre_mA, bench.centre_mA - bench.low_mA)
    wave = np.sin(phase - 0.5 * np.pi)
    return bench.centre_mA + float(rng.uniform(0.75, 1.0)) * room * wave


def pulses(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Pulses of random height and width on a base that changes every few of them."""
    current = np.empty(0)
    while current.size < samples:
        base = float(rng.uniform(bench.low_mA, bench.centre_mA))
        for _ in range(int(rng.integers(2, 6))):
            top = float(rng.uniform(bench.centre_mA, bench.high_mA))
            wide, rest = np.round(tau * np.exp(rng.uniform(np.log(0.5), np.log(9.0), 2))).astype(int)
            current = np.concatenate([current, np.full(max(wide, 1), top), np.full(max(rest, 1), base)])
    return current[:samples]


def triangles(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Triangles about the transition that grow to the whole range; a period is 25 to 90 time constants."""
    times, levels, side = [0.0], [bench.low_mA], 1.0
    while times[-1] < samples:
        times.append(times[-1] + 0.5 * tau * float(np.exp(rng.uniform(np.log(25.0), np.log(90.0)))))
        grown = min(0.25 + 0.9 * times[-1] / samples, 1.0)
        end = bench.high_mA if side > 0.0 else bench.low_mA
        levels.append(bench.centre_mA + grown * (end - bench.centre_mA))
        side = -side
    return np.interp(np.arange(samples), times, levels)
