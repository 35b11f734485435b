"""The drive between its samples, as a manifest or a mechanism says.

An integrator needs the drive at the start, the middle and the end of each of its steps: `nodes` (steps, 3). Three and
not two a step, because a held drive jumps at its samples. Before the first sample it is the first one, after the
last one the last.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import compiled_with

KernelT = TypeVar("KernelT", bound=Callable[..., Any])
HOLDS = ("linear", "zero", "band-limited")
_PADDING = 128
"""Samples by which a band-limited record is continued at each end, point-symmetric, so that it does not wrap."""


def compiled(function: KernelT) -> KernelT:
    """Return `function` as a kernel during which other threads run."""
    return cast(KernelT, compiled_with(function, nogil=True))


def nodes(
    samples: FloatArray, hold: str, substeps: int, delay: float = 0.0, *, within: bool = False
) -> FloatArray:
    """Return the drive (steps, 3) at the start, middle and end of each step.

    Args:
        samples: drive (n,) at the samples.
        hold: how it goes on between them.
        substeps: steps in an interval.
        delay: how late the drive is, in intervals.
        within: whether a held drive that jumps within a step stays between its levels there.

    Raises:
        ValueError: the hold is unknown.
    """
    if hold not in HOLDS:
        raise ValueError(f'hold must be one of {", ".join(HOLDS)}, got "{hold}"')
    if hold == "band-limited":
        return _band_limited(samples, substeps, delay)
    made = np.empty(((len(samples) - 1) * substeps, 3))
    if hold == "zero":
        _fill_held(samples, substeps, delay, within, made)
    else:
        _fill_linear(samples, substeps, delay, made)
    return made


@compiled
def _fill_linear(samples: FloatArray, substeps: int, delay: float, out: FloatArray) -> None:
    """Fill straight lines between samples; all instants of an interval have the same place in every interval."""
    last = len(samples) - 1
    instants = 2 * substeps + 1
    whole = np.empty(instants, np.int64)
    part = np.empty(instants)
    for i in range(instants):
        offset = i / (2 * substeps) - delay
        whole[i] = math.floor(offset)
        part[i] = offset - whole[i]
    at = np.empty(instants)
    for k in range(last):
        for i in range(instants):
            before = samples[min(max(k + whole[i], 0), last)]
            after = samples[min(max(k + whole[i] + 1, 0), last)]
            at[i] = before + part[i] * (after - before)
        for s in range(substeps):
            for c in range(3):
                out[k * substeps + s, c] = at[2 * s + c]


@compiled
def _fill_held(samples: FloatArray, substeps: int, delay: float, within: bool, out: FloatArray) -> None:
    """Fill constants; where a delayed jump falls inside a step, the parabola with the same first three moments.

    Its mean alone would keep the impulse but not the place: 1e-5 of the motion at 15 steps an interval, and this 1e-8.
    It goes beyond the two levels, by a third of the jump: a play would keep that, an event would see it. `within` them
    it is exact at both ends, and its mean right where the jump is no closer to one than a sixth of the step.
    """
    last = len(samples) - 1
    for k in range(last):
        for s in range(substeps):
            start = s / substeps - delay
            whole = math.floor(start)
            share = min((whole + 1 - start) * substeps, 1.0)
            if share > 1.0 - 1e-9:
                share = 1.0
            first = samples[min(max(k + whole, 0), last)]
            second = samples[min(max(k + whole + 1, 0), last)]
            weights = (
                share * (9.0 + share * (10.0 * share - 18.0)),
                share * (-1.5 + share * (7.5 - 5.0 * share)),
                share * (3.0 + share * (10.0 * share - 12.0)),
            )
            if within and share < 1.0:
                weights = (1.0, min(max(1.5 * share - 0.25, 0.0), 1.0), 0.0)
            for c in range(3):
                out[k * substeps + s, c] = weights[c] * first + (1.0 - weights[c]) * second


def _band_limited(samples: FloatArray, substeps: int, delay: float) -> FloatArray:
    """Return the drive of a band-limited record by a phase in its spectrum."""
    at = _sinc(samples)
    result = np.empty((len(samples) - 1, substeps, 3))
    for index in range(2 * substeps + 1):
        value = at(index / (2 * substeps) - delay)[:-1]
        if index < 2 * substeps:
            result[:, index // 2, index % 2] = value
        if index % 2 == 0 and index:
            result[:, index // 2 - 1, 2] = value
    return result.reshape(-1, 3)


def _sinc(samples: FloatArray) -> Callable[[float], FloatArray]:
    """Return `at(offset)`: the drive (n,) so many intervals after each sample, by a phase in its spectrum.

    Exact for a drive without content from half the sample rate on.
    """
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
