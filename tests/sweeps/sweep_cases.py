"""Sweeps by harmonic balance, written without the package's integrators, and manifests beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import root

Force = Callable[[np.ndarray, np.ndarray], np.ndarray]
HARMONICS, POINTS = 7, 128
RATE = 2.0 * np.pi * 100.0
DAMPING, STIFFNESS, CUBIC, GAIN = RATE / 40.0, RATE**2, 0.05 * RATE**2, 4e4
"""A resonator at 100 Hz with a quality factor of 40, um and V: its displacement is about 1 um at 0.25 V."""
UP = np.linspace(95.0, 106.0, 56)


class Sweep(NamedTuple):
    """One sweep as it is written: frequencies (n,) [Hz], drive amplitude [V], complex amplitudes (n,) [um], use."""

    frequency_hz: np.ndarray
    drive: float
    amplitude: np.ndarray
    use: str


def nothing(z: np.ndarray, v: np.ndarray) -> np.ndarray:
    return 0.0 * z


def response(
    frequency_hz: np.ndarray, drive: float, force: Force = nothing, cubic: float = CUBIC
) -> np.ndarray:
    """Complex amplitudes (n,) [um] of z'' + damping z' + stiffness z + cubic z^3 + force(z, z') = gain u.

    Unknowns are the cosines and sines of `HARMONICS` harmonics; the force is taken at `POINTS` instants of a period.
    Each row starts from the balance of the fundamental of the Duffing equation, a cubic in |Z|^2: a rising sweep from
    its largest root, a falling one from its smallest, which are the stable ones that it comes along.
    """
    rising = frequency_hz[-1] > frequency_hz[0]
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    order = np.arange(1, HARMONICS + 1)
    waves = np.exp(1j * np.outer(order, angle))
    found = np.empty(len(frequency_hz), complex)
    for k, frequency in enumerate(frequency_hz):
        s = 2j * np.pi * frequency * order

        def left(x: np.ndarray, s: np.ndarray = s) -> np.ndarray:
            amplitudes = x[:HARMONICS] + 1j * x[HARMONICS:]
            z, v = np.real(amplitudes @ waves), np.real((s * amplitudes) @ waves)
            pushed = 2.0 / POINTS * (np.conj(waves) @ (cubic * z**3 + force(z, v)))
            balance = (s**2 + DAMPING * s + STIFFNESS) * amplitudes + pushed
            balance[0] -= GAIN * drive
            return np.concatenate([balance.real, balance.imag]) / STIFFNESS

        for begin in starts(frequency, drive, cubic, rising=rising):
            guess = np.zeros(2 * HARMONICS)
            guess[0], guess[HARMONICS] = begin.real, begin.imag
            solved = root(left, guess, tol=1e-11)
            if np.abs(solved.fun).max() < 1e-9:
                break
        found[k] = solved.x[0] + 1j * solved.x[HARMONICS]
    return found


def starts(frequency: float, drive: float, cubic: float, *, rising: bool) -> list[complex]:
    """Complex amplitudes of the Duffing equation's fundamental, in the order in which a sweep meets them."""
    s = 2j * np.pi * frequency
    bracket, bent = s**2 + DAMPING * s + STIFFNESS, 0.75 * cubic
    squares = np.roots([bent**2, 2.0 * bent * bracket.real, abs(bracket) ** 2, -((GAIN * drive) ** 2)])
    real = sorted(float(one.real) for one in squares if abs(one.imag) < 1e-6 * abs(one) and one.real > 0.0)
    ordered = real[::-1] if rising else real
    return [GAIN * drive / (bracket + bent * one) for one in ordered]


def noisy(amplitude: np.ndarray, sigma: float, seed: int) -> np.ndarray:
    """Complex amplitudes with white noise of `sigma` in each part."""
    random = np.random.default_rng(seed)
    return amplitude + sigma * (
        random.standard_normal(len(amplitude)) + 1j * random.standard_normal(len(amplitude))
    )


def sweeps(
    force: Force = nothing, sigma: float = 0.002, turn: Callable[[np.ndarray], np.ndarray] | None = None
) -> list[Sweep]:
    """Rising and falling sweeps at two drives to fit, and one at a third to test; `turn`: a factor by frequency."""
    plan = (
        (UP, 0.08, "fit"),
        (UP, 0.4, "fit"),
        (UP[::-1], 0.4, "fit"),
        (UP, 0.2, "test"),
        (UP[::-1], 0.3, "test"),
    )
    made = []
    for seed, (frequency, drive, use) in enumerate(plan):
        amplitude = response(frequency, drive, force)
        if turn is not None:
            amplitude = amplitude * turn(frequency)
        made.append(Sweep(frequency, drive, noisy(amplitude, sigma, seed), use))
    return made


HEAD = """[dataset]
name = "resonator"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "V"
[signals.displacement]
role = "output"
unit = "um"
in_phase = "x"
quadrature = "y"
"""


def write_sweeps(folder: Path, made: Sequence[Sweep], head: str = HEAD) -> Path:
    """Write each sweep as CSV (f, x, y) and the manifest; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    text = head
    for k, one in enumerate(made):
        table = np.column_stack([one.frequency_hz, one.amplitude.real, one.amplitude.imag])
        np.savetxt(folder / f"s{k}.csv", table, delimiter=",", header="f,x,y", comments="")
        text += f'[[records]]\nfile = "s{k}.csv"\nfrequency = "f"\ndrive_amplitude = {one.drive}\nuse = "{one.use}"\n'
    path = folder / "dataset.toml"
    path.write_text(text)
    return path
