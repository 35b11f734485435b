"""Currents [mA] of the lab with the sputtered cantilever, planned in temperature and sent as their roots."""

from __future__ import annotations

import numpy as np
from foreign_common import Array
from foreign_kept_cantilever_styles import Bench, shown, stream
from scipy.signal import butter, sosfilt


def records(bench: Bench, seed: int) -> list[tuple[str, str, Array]]:
    """Name, use and current [mA] of each record: a staircase, four to fit, one or two to test."""
    rng = stream(bench.style, seed, "records")
    tau = bench.device.tau_s / bench.device.period_s  # samples
    samples = int(np.clip(330.0 * tau, rng.uniform(1800, 2400), 3600))
    short, half = round(0.7 * samples), samples // 2
    plan = [
        ("loops", "identify", staircase(bench, rng)),
        ("levels_a", "fit", levels(bench, samples, tau, rng)),
        ("noise_a", "fit", noise(bench, samples, tau, rng)),
        ("saw", "fit", saw(bench, short, tau, rng)),
        ("am", "fit", modulated(bench, short, tau, rng)),
        ("check", "test", np.concatenate([noise(bench, half, tau, rng), levels(bench, half, tau, rng)])),
    ]
    if rng.random() < 0.5:
        plan.append(("check_2", "test", modulated(bench, half, tau, rng)))
    return plan


def limits(bench: Bench) -> tuple[float, float]:
    """Coldest and hottest temperature [°C] of the records."""
    cold, hot = bench.device.gain_C_per_mA2 * np.array([bench.low_mA, bench.high_mA]) ** 2
    return bench.device.ambient_C + float(cold), bench.device.ambient_C + float(hot)


def staircase(bench: Bench, rng: np.random.Generator) -> Array:
    """A major loop, reversals from either branch where it is steep, one minor loop twice; even steps of temperature."""
    cold, hot = limits(bench)
    cells, ends = bench.device.cells, [cold, hot, cold]
    for part in np.sort(rng.uniform(0.25, 0.8, int(rng.integers(2, 4)))):
        ends += [float(np.quantile(cells.up, part)), cold]
    ends.append(hot)
    for part in np.sort(rng.uniform(0.2, 0.75, int(rng.integers(2, 4))))[::-1]:
        ends += [float(np.quantile(cells.down, part)), hot]
    inner = [
        float(np.quantile(cells.down, rng.uniform(0.3, 0.6))),
        float(np.quantile(cells.up, rng.uniform(0.4, 0.7))),
    ]
    ends += [*inner, *inner, cold]
    step, parts = (hot - cold) / int(rng.integers(24, 30)), [np.array([cold])]
    for start, stop in zip(ends, ends[1:], strict=False):
        parts.append(np.linspace(start, stop, max(round(abs(stop - start) / step), 1) + 1)[1:])
    return np.repeat(shown(bench, np.concatenate(parts)), bench.hold_samples)


def levels(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Random levels out of 16, even in temperature; each lasts 1, 2, 4, 8 or 16 dwells of 1.2 time constants."""
    ladder, current = np.linspace(*limits(bench), 16), np.empty(0)
    while current.size < samples:
        length = max(round(1.2 * tau * 2.0 ** int(rng.integers(0, 5))), 1)
        current = np.append(current, np.full(length, shown(bench, ladder[[rng.integers(0, 16)]])[0]))
    return current[:samples]


def noise(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Low-passed noise, pressed into the range of temperature; its corner is 0.01 to 0.05 cycles a time constant."""
    corner = 2.0 * float(np.exp(rng.uniform(np.log(0.01), np.log(0.05)))) / tau
    wave = sosfilt(butter(2, corner, output="sos"), rng.normal(size=3 * samples))[-samples:]
    cold, hot = limits(bench)
    place = 0.5 + 0.5 * np.tanh(1.1 * (wave - wave.mean()) / wave.std())
    return shown(bench, cold + (hot - cold) * place)


def saw(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """Teeth between random temperatures: heated in 1 to 6 time constants, cooled in 10 to 50, or reversed."""
    cold, hot = limits(bench)
    times, degrees = [0.0], [cold]
    quick_up = bool(rng.random() < 0.6)
    while times[-1] < samples:
        quick, slow = tau * rng.uniform(1.0, 6.0), tau * rng.uniform(10.0, 50.0)
        for length, part in zip((quick, slow) if quick_up else (slow, quick), (0.6, 0.0), strict=True):
            times.append(times[-1] + float(length))
            degrees.append(cold + (hot - cold) * float(part + 0.4 * rng.random()))
    return shown(bench, np.interp(np.arange(samples), times, degrees))


def modulated(bench: Bench, samples: int, tau: float, rng: np.random.Generator) -> Array:
    """A sine of current of 25 to 90 time constants, whose amplitude swells and shrinks 2 to 4 times."""
    place = np.arange(samples)
    period = tau * float(np.exp(rng.uniform(np.log(25.0), np.log(90.0))))
    swells = int(rng.integers(2, 5))
    depth = 0.15 + 0.85 * np.sin(np.pi * swells * place / samples) ** 2
    room = min(bench.high_mA - bench.centre_mA, bench.centre_mA - bench.low_mA)
    bias = bench.centre_mA + 0.1 * room * float(rng.uniform(-1.0, 1.0))
    return np.asarray(bias + 0.9 * room * depth * np.sin(2.0 * np.pi * place / period - 0.5 * np.pi))
