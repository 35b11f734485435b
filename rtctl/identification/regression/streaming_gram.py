"""Gram matrices of long records in one pass, one block in the cache: what a regression needs, and nothing else kept.

Columns of a row (`COLUMNS`), of a mass-normalised oscillator on a frame whose velocity w was measured, f = - dw/dt:

    y = z'' - f,  v = z',  z, z^3, z^5, z^7, z^2, z^2 v, abs(v) v, sign v, 1

`compute_filtered_gram` takes them by the bistable beam paper's mean filter and central differences, at every sample;
`compute_weak_gram` integrates them over bumps (`weak_form`), which differentiates no noisy signal. Either way a model
is a vector that says which sum of columns is left over, and its least squares, its R^2 on any record, cross-validation
and constraints are arithmetic on an 11 x 11 matrix a record.

Reference: the bistable beam paper, sections 2.3, 3.2; Messenger, Bortz, Multiscale Model. Simul. 19 (2021) 1474.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import compiled_with
from rtctl.identification.regression.mean_filter import NEIGHBOURS
from rtctl.identification.regression.weak_form import BUMPS_PER_HALF_WIDTH, sample_bump

KernelT = TypeVar("KernelT", bound=Callable[..., Any])
COLUMNS = ("y", "v", "z", "z^3", "z^5", "z^7", "z^2", "z^2 v", "abs(v) v", "sign v", "1")
_N = len(COLUMNS)
_BLOCK = 512


def _compiled(function: KernelT) -> KernelT:
    """Compile with `fastmath`: sums over a block may be taken in any order, which allows eight at a time."""
    made = compiled_with(function, nogil=True, error_model="numpy", fastmath=True)
    return cast(KernelT, made)


def compute_filtered_gram(
    displacement: FloatArray,
    frame_velocity: FloatArray,
    period_s: float,
    neighbours: int = NEIGHBOURS,
    *,
    each: bool = True,
) -> FloatArray:
    """Return the Gram matrix (11, 11) of the columns by the paper's filter; z in the data's unit.

    Args:
        displacement: (n,) displacement.
        frame_velocity: (n,) velocity of the frame.
        period_s: Sample period [s].
        neighbours: Samples of the filter to each side.
        each: Filter before each derivative, as the paper says ("several numerical derivatives ... by performing the
            same
            procedure"), so twice before the acceleration; else once, before both.
    """
    gram = np.zeros((_N, _N))
    _accumulate_filtered(displacement, frame_velocity, period_s, neighbours, neighbours if each else 0, gram)
    return gram + np.tril(gram, -1).T


def compute_weak_gram(
    displacement: FloatArray, frame_velocity: FloatArray, period_s: float, half_width_s: float
) -> FloatArray:
    """Return the Gram matrix (11, 11) of the columns integrated over bumps an eighth of `half_width_s` apart.

    Two neighbouring samples share a weight: an error of (w h)^2 / 6 in a motion of angular frequency w, which is 1e-4
    of a fifth harmonic at 10 kHz and the same in all columns.
    """
    m = max(4, 2 * round(0.5 * half_width_s / period_s))
    kernels = np.stack([sample_bump(m, period_s, order) for order in range(3)])
    paired = 0.5 * (kernels[:, :-1:2] + kernels[:, 1::2])
    gram = np.zeros((_N, _N))
    hop = max(1, m // (2 * BUMPS_PER_HALF_WIDTH))
    _accumulate_weak(
        displacement, frame_velocity, period_s, np.ascontiguousarray(paired), hop, NEIGHBOURS, gram
    )
    return gram + np.tril(gram, -1).T


@_compiled
def _add_block(block: Any, count: int, gram: Any) -> None:
    """Add the lower triangle of the Gram matrix of `block` (columns, rows)."""
    for i in range(_N):
        for j in range(i + 1):
            total = 0.0
            for k in range(count):
                total += block[i, k] * block[j, k]
            gram[i, j] += total


@_compiled
def _average_block(signal: Any, begin: int, count: int, width: int, out: Any) -> None:
    """Write `count` means over `width` samples from `begin` on; each call restarts the sum to bound rounding."""
    total = 0.0
    for k in range(begin, begin + width):
        total += signal[k]
    out[0] = total / width
    for k in range(1, count):
        total += signal[begin + k + width - 1] - signal[begin + k - 1]
        out[k] = total / width


@_compiled
def _accumulate_filtered(x: Any, w: Any, h: float, neighbours: int, again: int, gram: Any) -> None:
    """Add the filtered columns; `again`: neighbours of the filter before the second derivative, 0 for none."""
    width, halo = 2 * neighbours + 1, again + 2
    rows = len(x) - 2 * neighbours - 2 * halo
    z = np.empty(_BLOCK + 2 * halo)
    speed = np.empty(_BLOCK + 2 * halo - 2)
    smooth = np.empty(_BLOCK + 2)
    frame = np.empty(_BLOCK + 2)
    block = np.empty((_N, _BLOCK))
    slope = 0.5 / h
    for begin in range(0, rows, _BLOCK):
        count = min(_BLOCK, rows - begin)
        _average_block(x, begin, count + 2 * halo, width, z)
        _average_block(w, begin + halo - 1, count + 2, width, frame)
        for k in range(count + 2 * halo - 2):
            speed[k] = slope * (z[k + 2] - z[k])
        _average_block(speed, 0, count + 2, 2 * again + 1, smooth)
        for k in range(count):
            here = z[k + halo]
            v = speed[k + halo - 1]
            a = slope * (smooth[k + 2] - smooth[k])
            f = -slope * (frame[k + 2] - frame[k])
            square = here * here
            block[0, k] = a - f
            block[1, k] = v
            block[2, k] = here
            block[3, k] = square * here
            block[4, k] = square * square * here
            block[5, k] = square * square * square * here
            block[6, k] = square
            block[7, k] = square * v
            block[8, k] = abs(v) * v
            block[9, k] = np.sign(v)
            block[10, k] = 1.0
        _add_block(block, count, gram)


@_compiled
def _dot(a: Any, b: Any) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@_compiled
def _accumulate_weak(x: Any, w: Any, h: float, kernels: Any, hop: int, neighbours: int, gram: Any) -> None:
    """Add the integrated columns from sums of pairs of samples; kernels (3, pairs), `hop` in pairs.

    The velocity in abs(v) v and sign v is the filtered one: a few per cent of the motion's is enough for them.
    """
    length = kernels.shape[1]
    bumps_a_block = max(1, _BLOCK // hop)
    span = (bumps_a_block - 1) * hop + length
    pairs = len(x) // 2
    positions = (pairs - length) // hop + 1
    signals = np.zeros((8, span))
    block = np.empty((_N, bumps_a_block))
    phi, slope, curve = kernels[0], kernels[1], kernels[2]
    area = 0.0
    for k in range(length):
        area += 2.0 * phi[k]
    last = len(x) - 1
    for first in range(0, positions, bumps_a_block):
        count = min(bumps_a_block, positions - first)
        begin = first * hop
        for k in range(min(span, pairs - begin)):
            for s in range(8):
                signals[s, k] = 0.0
            for at in range(2 * (begin + k), 2 * (begin + k) + 2):
                z = x[at]
                square = z * z
                signals[0, k] += z
                signals[1, k] += w[at]
                signals[2, k] += square * z
                signals[3, k] += square * square * z
                signals[4, k] += square * square * square * z
                signals[5, k] += square
                low, high = max(at - neighbours - 1, 0), min(at + neighbours + 1, last)
                moved = x[high] - x[low] + x[max(high - 1, 0)] - x[min(low + 1, last)]
                v = moved / (2.0 * (high - low - 1) * h)
                signals[6, k] += abs(v) * v
                signals[7, k] += np.sign(v)
        for b in range(count):
            at, end = b * hop, b * hop + length
            block[0, b] = _dot(curve, signals[0, at:end]) - _dot(slope, signals[1, at:end])
            block[1, b] = -_dot(slope, signals[0, at:end])
            block[2, b] = _dot(phi, signals[0, at:end])
            block[3, b] = _dot(phi, signals[2, at:end])
            block[4, b] = _dot(phi, signals[3, at:end])
            block[5, b] = _dot(phi, signals[4, at:end])
            block[6, b] = _dot(phi, signals[5, at:end])
            block[7, b] = -_dot(slope, signals[2, at:end]) / 3.0
            block[8, b] = _dot(phi, signals[6, at:end])
            block[9, b] = _dot(phi, signals[7, at:end])
            block[10, b] = area
        _add_block(block, count, gram)
