"""Response of a linear system to a drive that is quadratic over each step, exact: the matrix exponential and moments.

x' = A x + b u, u(s) through its values at the start, middle and end of a step of h.
Reference: Van Loan, Computing integrals involving the matrix exponential (1978).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]


def propagator(a: FloatArray, b: FloatArray, h: float) -> tuple[FloatArray, FloatArray]:
    """(n, n) of the state and (n, 3) of the drive at a step's start, middle and end."""
    n = len(b)
    block = np.zeros((n + 3, n + 3))
    block[:n, :n], block[:n, n] = a * h, b * h
    block[n, n + 1] = block[n + 1, n + 2] = 1.0  # 1, s, s^2 / 2 for s from 0 to 1
    whole = expm(block)
    constant, slope, curve = whole[:n, n], whole[:n, n + 1], whole[:n, n + 2]
    start = constant - 3.0 * slope + 4.0 * curve
    middle = 4.0 * slope - 8.0 * curve
    end = -slope + 4.0 * curve
    return whole[:n, :n], np.column_stack((start, middle, end))


def linear_response(
    a: FloatArray,
    b: FloatArray,
    nodes: FloatArray,
    h: float,
    stride: int = 1,
    start: FloatArray | None = None,
) -> FloatArray:
    """States (samples, n), from `start` or zero, at every `stride`-th of the steps that `nodes` (steps, 3) drive."""
    state, drive = propagator(a, b, h)
    pushed = nodes @ drive.T
    states = np.zeros((len(nodes) + 1, len(b)))
    if start is not None:
        states[0] = start
    if len(b) == 1:
        delayed = np.concatenate((states[0], pushed[:, 0]))
        states[:, 0] = lfilter([1.0], [1.0, -state[0, 0]], delayed)
        return states[::stride]
    values, vectors = np.linalg.eig(state)
    modal = np.concatenate((states[:1], pushed)) @ np.linalg.inv(vectors).T
    for k, value in enumerate(values):
        modal[:, k] = lfilter([1.0], [1.0, -value], modal[:, k])
    return np.ascontiguousarray((modal[::stride] @ vectors.T).real)
