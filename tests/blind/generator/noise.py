"""Noise of the displacement sensor, scaled to an rms; quantisation rounds the reading itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]
KINDS = ("white", "ar1", "ar2", "one-over-f", "quantised")
WHITE_PART_OF_QUANTISED = 0.5  # of the rms; the rest is the rounding's


def noise_colour(rng: np.random.Generator, kind: str) -> FloatArray:
    """Denominator of the colouring filter of one case (the same sensor in all its records)."""
    if kind == "ar1":
        return np.array([1.0, -rng.uniform(0.5, 0.97)])
    if kind == "ar2":
        radius, angle = rng.uniform(0.6, 0.95), rng.uniform(0.05, 2.5)
        return np.array([1.0, -2 * radius * np.cos(angle), radius * radius])
    return np.array([1.0])


def add_noise(
    rng: np.random.Generator,
    clean: FloatArray,
    kind: str,
    rms: float,
    colour: FloatArray,
    *,
    like: int | None = None,
    every: int = 1,
) -> FloatArray:
    """The reading with noise of about this rms in a record of `like` samples, its own by default: that of 1/f grows
    with the record. `every`: so many times the case's own period; the noise is the same in time.
    """
    if kind == "quantised":
        white = WHITE_PART_OF_QUANTISED * rms
        step = np.sqrt(12.0 * (rms * rms - white * white))
        return step * np.round((clean + rng.normal(scale=white, size=clean.size)) / step)
    if kind == "one-over-f":
        return clean + rms * _one_over_f(rng, clean.size * every, like or clean.size * every)[::every]
    warm = 500
    impulse = lfilter([1.0], colour, np.eye(1, 4000)[0])
    e = lfilter([1.0], colour, rng.normal(size=clean.size * every + warm))[warm::every]
    return clean + rms * e / np.sqrt(np.sum(impulse * impulse))


def _one_over_f(rng: np.random.Generator, size: int, like: int) -> FloatArray:
    """Power as 1/f from one period in the record up, on a white floor; unit variance in a record of `like` samples."""
    white = np.fft.rfft(rng.normal(size=2 * size))
    coloured = np.fft.irfft(white * np.sqrt(_power(size)), 2 * size)[:size]
    return coloured / np.sqrt(np.mean(_power(like)))


def _power(size: int) -> FloatArray:
    """Of each frequency of twice a record, before it is scaled: the same where two lengths have the same frequency."""
    frequency = np.fft.rfftfreq(2 * size)
    return np.where(frequency > 0.0, 1.0 / np.maximum(frequency, 1.0 / size), 0.0) + 4.0
