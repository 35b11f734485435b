"""Drives of unit RMS that a lab sends to an oscillator; frequencies in cycles a sample."""

from __future__ import annotations

import numpy as np
from foreign_common import Array
from scipy.signal.windows import tukey


def unit(drive: Array) -> Array:
    """The same wave with RMS 1."""
    return drive / np.sqrt(np.mean(drive**2))


def band_noise(samples: int, low: float, high: float, rng: np.random.Generator) -> Array:
    """Gaussian noise between two frequencies."""
    spectrum = np.fft.rfft(rng.normal(size=samples))
    frequency = np.fft.rfftfreq(samples)
    spectrum[(frequency < low) | (frequency > high)] = 0.0
    return unit(np.fft.irfft(spectrum, samples))


def noise_burst(samples: int, low: float, high: float, rng: np.random.Generator) -> Array:
    """Band noise that swells, stays and dies away, then silence for the ring-down."""
    length = int(samples * rng.uniform(0.6, 0.85))
    burst = np.zeros(samples)
    burst[:length] = band_noise(length, low, high, rng) * tukey(length, 0.15)
    return unit(burst)


def sweep(samples: int, start: float, stop: float, logarithmic: bool) -> Array:
    """Sine whose frequency goes from `start` to `stop`, swelling and dying away over a twentieth."""
    place = np.linspace(0.0, 1.0, samples)
    if logarithmic:
        rate = np.log(stop / start)
        turns = start * samples * (np.exp(rate * place) - 1.0) / rate
    else:
        turns = samples * (start * place + 0.5 * (stop - start) * place**2)
    return unit(np.sin(2.0 * np.pi * turns) * tukey(samples, 0.1))


def multisine(samples: int, lines: int, low: float, high: float, rng: np.random.Generator) -> Array:
    """Lines of equal size and random phase that all fit into the record; it begins in full swing."""
    numbers = np.unique(np.round(np.linspace(low * samples, high * samples, lines))).astype(int)
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    spectrum[numbers] = np.exp(2j * np.pi * rng.random(numbers.size))
    return unit(np.fft.irfft(spectrum, samples))


def stepped_sine(samples: int, natural: float, rng: np.random.Generator) -> Array:
    """A sine whose frequency stays for 6 to 12 of its periods, then goes on; its phase does not jump."""
    rates = np.empty(0)
    frequencies = natural * rng.permutation(np.linspace(0.45, 1.7, int(rng.integers(6, 10))))
    while rates.size < samples:
        for frequency in frequencies:
            length = round(float(rng.uniform(6.0, 12.0)) / frequency)
            rates = np.append(rates, np.full(length, frequency))
    return unit(np.sin(2.0 * np.pi * np.cumsum(rates[:samples])))


def random_steps(samples: int, natural: float, rng: np.random.Generator) -> Array:
    """Random levels, each for 0.2 to 4 natural periods."""
    drive = np.empty(0)
    while drive.size < samples:
        length = max(round(float(np.exp(rng.uniform(np.log(0.2), np.log(4.0)))) / natural), 1)
        drive = np.append(drive, np.full(length, rng.uniform(-1.0, 1.0)))
    return unit(drive[:samples])


def coloured_noise(samples: int, natural: float, rng: np.random.Generator) -> Array:
    """Noise through two low passes, with most of its power below 2.5 times the natural frequency."""
    frequency = np.fft.rfftfreq(samples) / (2.0 * natural)
    spectrum = np.fft.rfft(rng.normal(size=samples)) / (1.0 + frequency**4)
    spectrum[0] = 0.0
    return unit(np.fft.irfft(spectrum, samples))
