"""Drives of the records, of rms about 1; frequencies in f0, lengths in samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

FloatArray = NDArray[np.float64]
RICH = ("multisine", "noise", "telegraph", "sweep up", "sweep down")
POOR = ("steps", "bursts", "ring-down")


def excite(
    rng: np.random.Generator, kind: str, samples: int, spp: float, smooth: bool, shift: float
) -> FloatArray:
    """One record's drive; `spp` samples a period of f0, `smooth`: nothing near the Nyquist frequency.

    `shift` moves its band and its dwell times: test records get another one than fit records.
    """
    u = _KINDS[kind](rng, samples, spp, shift)
    if smooth:
        u = sosfiltfilt(butter(6, 0.5, output="sos"), u * fade(samples, spp))
    return np.asarray(u)


def fade(samples: int, spp: float) -> FloatArray:
    """A band-limited drive begins and ends at zero, so that its sinc sum needs nothing outside the record."""
    width = max(8, int(2 * spp))
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(width) / width)
    window = np.ones(samples)
    window[:width] = ramp
    window[-width:] = ramp[::-1]
    return window


def _multisine(rng: np.random.Generator, samples: int, spp: float, shift: float) -> FloatArray:
    period = samples // int(rng.integers(1, 4))
    low, high = rng.uniform(0.15, 0.6) * shift, rng.uniform(1.6, 3.0) * shift
    first, last = max(1, int(low * period / spp)), int(min(high * period / spp, 0.4 * period))
    lines = np.arange(first, last + 1)
    lines = lines[rng.random(lines.size) < rng.uniform(0.3, 1.0)] if lines.size > 40 else lines
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    u = np.resize(np.fft.irfft(spectrum, period), samples)
    return u / u.std()


def _sweep(rng: np.random.Generator, samples: int, spp: float, shift: float, upward: bool) -> FloatArray:
    low, high = rng.uniform(0.3, 0.7) * shift, rng.uniform(1.4, 2.2) * shift
    begin, end = (low, high) if upward else (high, low)
    n = np.arange(samples)
    return np.sqrt(2) * np.sin(2 * np.pi / spp * (begin * n + 0.5 * (end - begin) * n * n / samples))


def _noise(rng: np.random.Generator, samples: int, spp: float, shift: float) -> FloatArray:
    band = np.array([rng.uniform(0.1, 0.4), rng.uniform(1.3, 2.5)]) * shift * 2.0 / spp
    u = sosfiltfilt(butter(3, np.clip(band, 1e-3, 0.9), "band", output="sos"), rng.normal(size=samples + 400))
    u = u[200:-200]
    return u / u.std()


def _hold_levels(levels: FloatArray, dwell: NDArray[np.int64], samples: int) -> FloatArray:
    u = np.repeat(levels, dwell)[:samples]
    return u / np.sqrt(np.mean(u * u))


def _telegraph(rng: np.random.Generator, samples: int, spp: float, shift: float) -> FloatArray:
    count = int(samples / (0.2 * spp / shift)) + 2
    dwell = np.maximum(2, rng.exponential(0.7 * spp / shift, count) + 0.2 * spp / shift).astype(np.int64)
    choices = np.array([-1.0, 1.0]) if rng.random() < 0.4 else rng.uniform(-1.0, 1.0, int(rng.integers(3, 8)))
    return _hold_levels(rng.choice(choices, count), dwell, samples)


def _steps(rng: np.random.Generator, samples: int, spp: float, shift: float) -> FloatArray:
    dwell = rng.uniform(6.0, 25.0, int(samples / (6.0 * spp / shift)) + 2) * spp / shift
    return _hold_levels(rng.uniform(-1.0, 1.0, dwell.size), dwell.astype(np.int64), samples)


def _bursts(rng: np.random.Generator, samples: int, spp: float, shift: float) -> FloatArray:
    u = np.zeros(samples)
    begin = 0
    while begin < samples:
        length = int(rng.uniform(5.0, 30.0) * spp)
        n = np.arange(min(length, samples - begin))
        u[begin : begin + n.size] = np.sin(2 * np.pi * rng.uniform(0.5, 1.5) * shift * n / spp) * rng.uniform(
            0.4, 1.0
        )
        begin += length + int(rng.uniform(3.0, 25.0) * spp)
    return u / u.std()


_KINDS = {
    "multisine": _multisine,
    "noise": _noise,
    "telegraph": _telegraph,
    "steps": _steps,
    "bursts": _bursts,
    "sweep up": lambda rng, samples, spp, shift: _sweep(rng, samples, spp, shift, True),
    "sweep down": lambda rng, samples, spp, shift: _sweep(rng, samples, spp, shift, False),
    "ring-down": lambda rng, samples, spp, shift: np.zeros(samples),
}
