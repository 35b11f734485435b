"""What the foreign generators of all kinds share: draws, flicker noise, and the search for an effect's size."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, log, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TRIALS = 12  # of a size
CLOSE = 0.1  # log of a share over the wished one that ends the search


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number with its logarithm uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def flicker(samples: int, rng: np.random.Generator) -> Array:
    """Noise with power 1/f and unit variance over its record."""
    spectrum = np.fft.rfft(rng.normal(size=samples))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, samples)
    return noise / noise.std()


def search_size(
    reached: Callable[[float], float], start: float, low: float, high: float, wanted: float
) -> float:
    """The size from `low` to `high` whose share `reached(size)` is nearest to `wanted`."""
    best_miss, best, size = inf, start, start
    small, large = low, high  # bounds that the trials narrow
    for _ in range(TRIALS):
        share = reached(size)
        miss = abs(log(max(share, 1e-6) / wanted))
        if miss < best_miss:
            best_miss, best = miss, size
        if miss < CLOSE:
            break
        if share < wanted:
            small = size
        else:
            large = size
        guess = size * min(max(wanted / max(share, 1e-6), 0.1), 10.0)
        size = guess if small * 1.02 < guess < large / 1.02 else sqrt(small * large)
    return best
