"""The drive between its samples: what a manifest says of it, or what a mechanism makes of that.

An integrator needs the drive at the start, the middle and the end of each of its steps: `nodes` (steps, 3). Three and
not two a step, because a held drive jumps at its samples. Before the first sample it is the first one, after the
last one the last.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
HOLDS = ("linear", "zero", "band-limited")
_PADDING = 128
"""Samples by which a band-limited record is continued at each end, point-symmetric, so that it does not wrap."""


def nodes(samples: FloatArray, hold: str, substeps: int, delay: float = 0.0) -> FloatArray:
    """Drive (steps, 3) between `samples` (n,), `substeps` steps an interval, `delay` intervals late.

    Raises ValueError for an unknown hold.
    """
    if hold not in HOLDS:
        raise ValueError(f'hold must be one of {", ".join(HOLDS)}, got "{hold}"')
    if hold == "zero":
        return _held(samples, substeps, delay)
    at = _linear(samples) if hold == "linear" else _band_limited(samples)
    result = np.empty((len(samples) - 1, substeps, 3))
    for index in range(2 * substeps + 1):
        value = at(index / (2 * substeps) - delay)[:-1]
        if index < 2 * substeps:
            result[:, index // 2, index % 2] = value
        if index % 2 == 0 and index:
            result[:, index // 2 - 1, 2] = value
    return result.reshape(-1, 3)


def _held(samples: FloatArray, substeps: int, delay: float) -> FloatArray:
    """The mean over each step: where a delayed jump falls inside one, its impulse is kept to the last bit of time."""
    if delay == 0.0:
        mean = np.repeat(samples[:-1], substeps)
    else:
        grid = np.arange((len(samples) - 1) * substeps + 1) / substeps - delay
        first, last = min(grid[0], 0.0), max(grid[-1], len(samples) - 1.0)
        instants = np.concatenate(([first], np.arange(len(samples), dtype=np.float64), [last]))
        held = np.concatenate(([samples[0]], samples))
        impulse = np.concatenate(([0.0], np.cumsum(held * np.diff(instants))))
        mean = np.diff(np.interp(grid, instants, impulse)) * substeps
    return np.repeat(mean[:, None], 3, axis=1)


def _linear(samples: FloatArray) -> Callable[[float], FloatArray]:
    """`at(offset)`: the drive (n,) so many intervals after each sample."""

    def at(offset: float) -> FloatArray:
        whole = int(np.floor(offset))
        before = samples[np.clip(np.arange(len(samples)) + whole, 0, len(samples) - 1)]
        after = samples[np.clip(np.arange(len(samples)) + whole + 1, 0, len(samples) - 1)]
        between: FloatArray = before + (offset - whole) * (after - before)
        return between

    return at


def _band_limited(samples: FloatArray) -> Callable[[float], FloatArray]:
    """The same by a phase in the spectrum: exact for a drive without content from half the sample rate on."""
    from scipy.fft import irfft, next_fast_len, rfft

    padding = min(_PADDING, len(samples) - 1)
    before = 2.0 * samples[0] - samples[padding:0:-1]
    after = 2.0 * samples[-1] - samples[-2 : -padding - 2 : -1]
    padded = np.concatenate((before, samples, after))
    length = int(next_fast_len(len(padded), real=True))
    tail = np.linspace(padded[-1], padded[0], length - len(padded) + 2)[1:-1]
    spectrum = rfft(np.concatenate((padded, tail)))
    turn = 2j * np.pi * np.fft.rfftfreq(length)

    def at(offset: float) -> FloatArray:
        if offset == 0.0:
            return samples
        shifted: FloatArray = irfft(spectrum * np.exp(turn * offset), length)
        return shifted[padding : padding + len(samples)]

    return at
