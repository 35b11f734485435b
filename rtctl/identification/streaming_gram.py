"""Gram matrices of long records in one pass, one block in the cache: what a regression needs, and nothing else kept.

Columns of a row (`COLUMNS`), of a mass-normalised oscillator on a frame whose velocity w was measured, f = - dw/dt:

    y = z'' - f,  v = z',  z, z^3, z^5, z^7, z^2, z^2 v, |v| v, sign v, 1

`filtered_gram` takes them by the bistable beam paper's mean filter and central differences, at every sample;
`weak_gram` integrates them over bumps (`weak_form`), which differentiates no noisy signal. Either way a model is a
vector that says which sum of columns is left over, and its least squares, its R^2 on any record, cross-validation and
constraints are arithmetic on an 11 x 11 matrix a record.

Reference: the bistable beam paper, sections 2.3, 3.2; Messenger, Bortz, Multiscale Model. Simul. 19 (2021) 1474.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

from rtctl.identification.mean_filter import NEIGHBOURS
from rtctl.identification.weak_form import BUMPS_PER_HALF_WIDTH, bump

FloatArray = NDArray[np.float64]
KernelT = TypeVar("KernelT", bound=Callable[..., Any])
COLUMNS = ("y", "v", "z", "z^3", "z^5", "z^7", "z^2", "z^2 v", "|v| v", "sign v", "1")
_N = len(COLUMNS)
_BLOCK = 512


def _compiled(function: KernelT) -> KernelT:
    """Sums over a block may be taken in any order (`fastmath`): that is what makes them eight at a time."""
    made = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=True)(function)
    return cast(KernelT, made)


def filtered_gram(
    displacement: FloatArray, frame_velocity: FloatArray, period_s: float, neighbours: int = NEIGHBOURS
) -> FloatArray:
    """(11, 11) of `displacement` (n,) and `frame_velocity` (n,), by the paper's filter; z in the data's unit."""
    gram = np.zeros((_N, _N))
    _filtered(displacement, frame_velocity, period_s, neighbours, gram)
    return gram + np.tril(gram, -1).T


def weak_gram(
    displacement: FloatArray, frame_velocity: FloatArray, period_s: float, half_width_s: float
) -> FloatArray:
    """(11, 11) of the same by bumps of `half_width_s`, an eighth of it apart; each row's integral over its bump."""
    m = max(2, round(half_width_s / period_s))
    kernels = np.stack([bump(m, period_s, order) for order in range(3)])
    gram = np.zeros((_N, _N))
    _weak(
        displacement, frame_velocity, period_s, kernels, max(1, m // BUMPS_PER_HALF_WIDTH), NEIGHBOURS, gram
    )
    return gram + np.tril(gram, -1).T


@_compiled
def _add(block: Any, count: int, gram: Any) -> None:
    """The lower triangle of the Gram matrix of `block` (columns, rows)."""
    for i in range(_N):
        for j in range(i + 1):
            total = 0.0
            for k in range(count):
                total += block[i, k] * block[j, k]
            gram[i, j] += total


@_compiled
def _mean_of(signal: Any, begin: int, count: int, width: int, out: Any) -> None:
    """Means over `width` samples from `begin` on, so many of them; the sum begins anew, so rounding does not grow."""
    total = 0.0
    for k in range(begin, begin + width):
        total += signal[k]
    out[0] = total / width
    for k in range(1, count):
        total += signal[begin + k + width - 1] - signal[begin + k - 1]
        out[k] = total / width


@_compiled
def _filtered(x: Any, w: Any, h: float, neighbours: int, gram: Any) -> None:
    width = 2 * neighbours + 1
    rows = len(x) - 2 * neighbours - 4
    z = np.empty(_BLOCK + 4)
    frame = np.empty(_BLOCK + 4)
    block = np.empty((_N, _BLOCK))
    slope, curve = 0.5 / h, 0.25 / (h * h)
    for begin in range(0, rows, _BLOCK):
        count = min(_BLOCK, rows - begin)
        _mean_of(x, begin, count + 4, width, z)
        _mean_of(w, begin, count + 4, width, frame)
        for k in range(count):
            here = z[k + 2]
            v = slope * (z[k + 3] - z[k + 1])
            a = curve * (z[k + 4] - 2.0 * here + z[k])
            f = -slope * (frame[k + 3] - frame[k + 1])
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
        _add(block, count, gram)


@_compiled
def _dot(a: Any, b: Any) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@_compiled
def _weak(x: Any, w: Any, h: float, kernels: Any, hop: int, neighbours: int, gram: Any) -> None:
    """The velocity in |v| v and sign v is the filtered one: a few per cent of the motion's is enough for them."""
    length = kernels.shape[1]
    bumps_a_block = max(1, _BLOCK // hop)
    span = (bumps_a_block - 1) * hop + length
    positions = (len(x) - length) // hop + 1
    signals = np.empty((6, span))
    block = np.empty((_N, bumps_a_block))
    phi, slope, curve = kernels[0], kernels[1], kernels[2]
    area = 0.0
    for k in range(length):
        area += phi[k]
    for first in range(0, positions, bumps_a_block):
        count = min(bumps_a_block, positions - first)
        begin = first * hop
        samples = min(span, len(x) - begin)
        for k in range(samples):
            z = x[begin + k]
            square = z * z
            signals[0, k] = square * z
            signals[1, k] = square * square * z
            signals[2, k] = square * square * square * z
            signals[3, k] = square
            at = begin + k
            low, high = max(at - neighbours - 1, 0), min(at + neighbours + 1, len(x) - 1)
            mean = (x[high] - x[low] + x[max(high - 1, 0)] - x[min(low + 1, len(x) - 1)]) / (
                2.0 * (high - low - 1)
            )
            v = mean / h
            signals[4, k] = abs(v) * v
            signals[5, k] = np.sign(v)
        for b in range(count):
            at = b * hop
            z = x[begin + at : begin + at + length]
            frame = w[begin + at : begin + at + length]
            cube = signals[0, at : at + length]
            block[0, b] = _dot(curve, z) - _dot(slope, frame)
            block[1, b] = -_dot(slope, z)
            block[2, b] = _dot(phi, z)
            block[3, b] = _dot(phi, cube)
            block[4, b] = _dot(phi, signals[1, at : at + length])
            block[5, b] = _dot(phi, signals[2, at : at + length])
            block[6, b] = _dot(phi, signals[3, at : at + length])
            block[7, b] = -_dot(slope, cube) / 3.0
            block[8, b] = _dot(phi, signals[4, at : at + length])
            block[9, b] = _dot(phi, signals[5, at : at + length])
            block[10, b] = area
        _add(block, count, gram)
