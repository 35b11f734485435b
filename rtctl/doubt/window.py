"""A window of rows in a few numbers: what the model gets wrong in it, along each direction, and how it moved.

c_j = sum s_j r / (rms(s_j) n)      the residual along direction j, in the measure of r
noise = median |r_k - 2 r_(k-1) + r_(k-2)| / (0.6745 sqrt 6)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.doubt.belief import Predicted, Rows

LEAST_MOTION = 0.01
"""Of the range: a window that moves less says nothing about how the device answers."""


class Window(NamedTuple):
    """The numbers of a window."""

    first: int
    """Number of its first sample, and of its last."""
    last: int
    along: FloatArray
    """c_j of the reading (directions,)."""
    output_along: FloatArray
    """c_j of the reference (directions,) [its unit]; NaN: no reading of it."""
    rms: float
    """Of the reading's residual."""
    output_rms: float
    """Of the reference's [its unit]; NaN: no reading of it."""
    fast: float
    """RMS of the reading's noise, from the part of the residual that changes from row to row."""
    estimate_off: float
    """Mean absolute difference of the loop's estimate and the model's output [the reference's unit]."""
    motion: FloatArray
    """Where the window was: mean, lowest and highest of each coordinate (3 m,), in units of their ranges."""
    moved: float
    """How far it moved, of the range."""
    gram: FloatArray
    """Products of the answers of the reading (directions, directions)."""
    output_gram: FloatArray


def window_of(rows: Rows, seen: Predicted) -> Window:
    """Return the numbers of a window of at least two rows.

    Args:
        rows: its rows.
        seen: what the model says of them.
    """
    r = seen.residual
    e = rows.reference - seen.output
    there = np.isfinite(e)
    motion = np.concatenate([seen.motion.mean(0), seen.motion.min(0), seen.motion.max(0)])
    second = np.diff(r, n=2)
    return Window(
        int(rows.samples[0]), int(rows.samples[-1]),
        _along(r, seen.answers),
        _along(e[there], seen.output_answers[there]) if there.sum() > 1 else np.full(seen.answers.shape[1], np.nan),
        float(np.sqrt(np.mean(r * r))),
        float(np.sqrt(np.mean(e[there] ** 2))) if there.sum() > 1 else float("nan"),
        float(np.median(np.abs(second)) / (0.6745 * np.sqrt(6.0))) if len(second) else 0.0,
        float(np.mean(np.abs(rows.estimate - seen.output))),
        motion,
        float(np.ptp(seen.motion[:, 0])),
        seen.answers.T @ seen.answers,
        seen.output_answers[there].T @ seen.output_answers[there],
    )  # fmt: skip


def _along(r: FloatArray, answers: FloatArray) -> FloatArray:
    """Return c_j (directions,)."""
    size = np.sqrt(np.mean(answers * answers, axis=0))
    found: FloatArray = (answers.T @ r) / (len(r) * np.maximum(size, 1e-300))
    return np.where(size > 0.0, found, 0.0)
