"""The film's magnetisation and its effect on a pure field: M = M_s (coth a - 1/a), a = 3 chi H / M_s   (10)."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.reproduce.me.device import ARGUMENT, SATURATION

SERIES_BELOW = 0.02
SAMPLES = 4096


def langevin(a: FloatArray) -> FloatArray:
    """Return coth a - 1/a."""
    small = np.abs(a) < SERIES_BELOW
    safe = np.where(small, 1.0, a)
    return np.where(small, a / 3.0 - a**3 / 45.0, 1.0 / np.tanh(safe) - 1.0 / safe)


def magnetisation(field_mT: FloatArray) -> FloatArray:
    """Return M [A/m] at a flux density [mT] in air."""
    return np.asarray(SATURATION * langevin(ARGUMENT * np.asarray(field_mT)))


def departure(field_mT: float) -> float:
    """Return the relative departure of M from its tangent at zero."""
    return float(1.0 - 3.0 * langevin(np.array(ARGUMENT * field_mT)) / (ARGUMENT * field_mT))


def harmonics(signal: FloatArray) -> FloatArray:
    """Return the amplitudes of harmonics 0, 1, 2, ... of one cycle's samples (n,)."""
    amplitude = np.abs(np.fft.rfft(signal)) * 2.0 / len(signal)
    amplitude[0] *= 0.5
    return amplitude


def distortion(signal: FloatArray, fundamental: int = 1) -> float:
    """Return the THD of one cycle's samples: root of the harmonics' power over the fundamental's amplitude."""
    found = harmonics(signal)
    multiples = found[2 * fundamental :: fundamental]
    return float(np.sqrt(np.sum(multiples**2)) / found[fundamental])


def cycle_of(field_mT: float, samples: int = SAMPLES) -> FloatArray:
    """Return a pure field over one cycle."""
    return np.asarray(field_mT * np.cos(2.0 * np.pi * np.arange(samples) / samples))
