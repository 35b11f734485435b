"""First-order lag tau s' = P(t) - s over one step, exact for quadratic P; the last bits are those of `thermal.heat`."""

from __future__ import annotations

import math

import numpy as np

from rtctl.arithmetic.elementary import exp, expm1, log
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel

TURN_ITERATIONS = 3


@kernel
def relax(s: float, start: float, middle: float, end: float, h: float, tau: float) -> float:
    """Return s after h [s], P given at start, middle and end. tau = 0: follows P at its end."""
    decay = exp(-h / tau)
    to_middle, to_end = middle - start, end - start
    b, c = 4.0 * to_middle - to_end, 2.0 * to_end - 4.0 * to_middle
    if b == 0.0 and c == 0.0:
        return start + (s - start) * decay
    r = tau / h  # particular solution A + B x + c x^2 over x = t / h in 0 .. 1
    B = b - 2.0 * r * c
    A = start - r * B
    return A + B + c + (s - A) * decay


@kernel
def turn(s: float, start: float, middle: float, end: float, h: float, tau: float) -> float:
    """Return the extremum of s within the step of `relax`, NaN without one: where s meets P.

    By iteration with the slope of P there; a follower that is much faster than a step turns at its very start.
    """
    to_middle, to_end = middle - start, end - start
    b, c = 4.0 * to_middle - to_end, 2.0 * to_end - 4.0 * to_middle
    x = 0.0
    for _ in range(TURN_ITERATIONS):
        behind = (b + c * x) * tau / h
        left = behind / (s - start + behind)
        if not 0.0 < left < 1.0:
            return math.nan
        x = -log(left) * tau / h
        if x >= 1.0:
            return math.nan
    return start + x * (b + c * x)


@kernel
def through(start: float, middle: float, end: float, x: float) -> float:
    """Return the quadratic through start, middle and end at x in 0 .. 1."""
    to_middle, to_end = middle - start, end - start
    return float(start + x * (4.0 * to_middle - to_end + x * (2.0 * to_end - 4.0 * to_middle)))


@kernel
def at(nodes: FloatArray, row: int, x: float) -> float:
    """Return the quadratic through the nodes of a piece at x in 0 .. 1."""
    return through(nodes[row, 0], nodes[row, 1], nodes[row, 2], x)


@background_kernel
def heat_pieces(
    nodes: FloatArray, durations: FloatArray, substeps: int, tau: float, start: float
) -> FloatArray:
    """Return the surrogate s [mA^2] at all substeps' ends (pieces * substeps + 1,).

    It begins at `start` [mA^2]; NaN: at rest in the first current.
    """
    s = nodes[0, 0] * nodes[0, 0] if math.isnan(start) else start
    path = np.empty(nodes.shape[0] * substeps + 1)
    path[0] = s
    for row in range(nodes.shape[0]):
        h = durations[row % durations.size] / substeps
        for j in range(substeps):
            first, middle = at(nodes, row, j / substeps), at(nodes, row, (j + 0.5) / substeps)
            last = at(nodes, row, (j + 1.0) / substeps)
            s = relax(s, first * first, middle * middle, last * last, h, tau)
            path[row * substeps + j + 1] = s
    return path


def lag(values: FloatArray, steps: FloatArray, tau: float) -> FloatArray:
    """Return y with tau y' = values - y, settled on the first; values linear between instants `steps` apart."""
    return values + behind(values, steps, np.array([tau]), np.ones(1))


@background_kernel
def behind(values: FloatArray, steps: FloatArray, taus: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weighted sum of the lag errors of `values` (n,) for several `taus` (m,), each as `relax` has it.

    d = y - values goes to d e^(-h / tau) - (tau / h) (1 - e^(-h / tau)) x the rise of the values over h.
    """
    decays, gains = np.empty((steps.size, taus.size)), np.empty((steps.size, taus.size))
    for k in range(steps.size):
        for m in range(taus.size):
            lost = -expm1(-steps[k] / taus[m])
            decays[k, m], gains[k, m] = 1.0 - lost, taus[m] / steps[k] * lost
    missed, total = np.zeros(taus.size), np.zeros(values.size)
    for k in range(1, values.size):
        rise, at_step = values[k] - values[k - 1], (k - 1) % steps.size
        for m in range(taus.size):
            missed[m] = missed[m] * decays[at_step, m] - gains[at_step, m] * rise
            total[k] += weights[m] * missed[m]
    return total
