"""The current between its samples as smooth pieces: one a sample period, two where it is delayed.

A delay of w periods and a part f of one puts a sample's instant at f into each period: the piece before it belongs to
the sample period w + 1 back, the one after it to that w back. A negative delay is a reading that is taken after its
row's current has begun to act. Before the first sample the current was the first one's, after the last the last one's.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.simulations.vo2.mechanism import Commanded, Pieces


def pieces_of(commanded: Commanded) -> Pieces:
    """Return nodes over the n - 1 periods between first and last sample. Raises ValueError on an unknown hold."""
    late = commanded.delay_s / commanded.period_s
    whole = math.floor(late)
    part = late - whole
    spans = [(whole, 0.0, 1.0)] if part == 0.0 else [(whole + 1, 1.0 - part, 1.0), (whole, 0.0, 1.0 - part)]
    nodes = np.stack([_nodes(commanded, *span) for span in spans], axis=1)
    durations = np.array([commanded.period_s * (end - begin) for _, begin, end in spans])
    return Pieces(np.ascontiguousarray(nodes.reshape(-1, 3)), durations)


def _nodes(commanded: Commanded, back: int, begin: float, end: float) -> FloatArray:
    """Return (periods, 3): start, middle and end of `begin` to `end` of the sample period `back` periods back."""
    x = commanded.samples
    index = np.arange(len(x) - 1) - back
    known = np.concatenate((x, commanded.onward))
    last = len(known) - 1
    if commanded.hold == "zero":
        held = known[np.clip(index, 0, last)]
        return np.stack([held, held, held], axis=1)
    fractions = (begin, 0.5 * (begin + end), end)
    if commanded.hold == "linear":
        first = known[np.clip(index, 0, last)]
        step = known[np.clip(index + 1, 0, last)] - first
        return np.stack([first + fraction * step for fraction in fractions], axis=1)
    if commanded.hold == "band-limited":
        columns = [_between(known, fraction)[np.clip(index, 0, last)] for fraction in fractions]
        return np.where((index < 0)[:, None], x[0], np.stack(columns, axis=1))
    raise ValueError(
        f'hold "{commanded.hold}" of the current is not known; known: zero, linear, band-limited'
    )


def _between(samples: FloatArray, fraction: float) -> FloatArray:
    """Return band-limited values `fraction` of a period after each sample; mirrored at both ends."""
    if fraction in (0.0, 1.0):
        return samples if fraction == 0.0 else np.append(samples[1:], samples[-1])
    mirrored = np.concatenate((samples, samples[::-1]))
    phase = np.exp(2j * np.pi * np.fft.rfftfreq(len(mirrored)) * fraction)
    return np.fft.irfft(np.fft.rfft(mirrored) * phase, len(mirrored))[: len(samples)]
