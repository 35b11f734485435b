"""Linear systems of first and second order under a drive that is a polynomial over each step: exact, however stiff.

x' = rate (u - x)                              | a lag
q'' + 2 ratio w q' + w^2 q = u                 | a mode

The lag's weights have closed forms, which lose their digits where a step is short; a series serves there. The mode's
come from the exponential of the system with the polynomial's derivatives as further states (Van Loan, Computing
integrals involving the matrix exponential, IEEE Trans. Automatic Control 23(3), 1978).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm

from plant_sim.oscillator.integration.holds import compiled
from rtctl.border.arrays import FloatArray

PARABOLA: FloatArray = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [2.0, -4.0, 2.0]])
"""Matrix: coefficients of 1, s, s^2 from values at s = 0, 1/2, 1."""
PARABOLA_OF_MOMENTS: FloatArray = np.array([[9.0, -36.0, 30.0], [-1.5, 15.0, -15.0], [3.0, -24.0, 30.0]])
"""Matrix: values at s = 0, 1/2, 1 of the parabola with given integrals of x, s x, s^2 x from 0 to 1."""
SERIES_BELOW = 4.0
SERIES_TERMS = 40
"""Terms of a series: 4^40 / 40! is 1e-24."""


class Lag(NamedTuple):
    """The response of a lag, from rest, to s^k over a step (s from 0 to 1), k = 0, 1, ...; one row each."""

    end: FloatArray
    """Response (degree + 1,) at s = 1; 1 - end[0] is what remains of the state."""
    moments: FloatArray
    """Integrals (degree + 1, 3) of x, s x and s^2 x."""


def lag(steps: float, degree: int) -> Lag:
    """Return the response of x' = steps (s^k - x), k up to `degree`; `steps`: a step in time constants, > 0."""
    if steps < SERIES_BELOW:
        divisors, powers = _of_series(degree)
        terms = -np.cumprod(np.full(SERIES_TERMS, -steps)) / divisors
        return Lag(terms.sum(axis=1), (terms[:, :, None] / powers).sum(axis=1))
    end = [-math.expm1(-steps)]
    for k in range(1, degree + 1):
        end.append(1.0 - k / steps * end[-1])
    moments = np.empty((degree + 1, 3))
    for k in range(degree + 1):
        before = 0.0
        for order in range(3):
            before = 1.0 / (k + order + 1) - (end[k] - order * before) / steps
            moments[k, order] = before
    return Lag(np.array(end), moments)


@cache
def _of_series(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return of term m of the series (degree + 1, terms) of s^k: (k + m)! / k!, and its power of s plus 1, 2, 3."""
    m = np.arange(1.0, SERIES_TERMS + 1)
    k = np.arange(degree + 1.0)[:, None]
    divisors = np.cumprod(k + m, axis=1, dtype=np.float64)
    return divisors, (k + m)[:, :, None] + np.arange(1.0, 4.0)


def lagging_nodes(nodes: FloatArray, steps: float, settled: float = 1.0) -> FloatArray:
    """Return `nodes` (steps, 3) of a drive behind a lag that starts at `settled` times the first.

    Each parabola has the first three moments of the lag's output. So the impulse of a step is right to the last bits
    even where the lag is over within it, which its values at three instants would not give.
    """
    made = lag(steps, 2)
    of_nodes = PARABOLA_OF_MOMENTS @ made.moments.T @ PARABOLA
    of_state = 1.0 - PARABOLA_OF_MOMENTS @ made.moments[0]
    out = np.empty_like(nodes)
    _follow(nodes, settled * nodes[0, 0], 1.0 - made.end[0], made.end @ PARABOLA, of_state, of_nodes, out)
    return out


@compiled
def _follow(
    nodes: Any, begin: float, decay: float, push: Any, of_state: Any, of_nodes: Any, out: Any
) -> None:
    """Follow x of a lag from step to step, with the three values that represent it in each."""
    x = begin
    for i in range(nodes.shape[0]):
        u1, u2, u4 = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        for k in range(3):
            driven = of_nodes[k, 0] * u1 + of_nodes[k, 1] * u2 + of_nodes[k, 2] * u4
            out[i, k] = of_state[k] * x + driven
        x = decay * x + (push[0] * u1 + push[1] * u2 + push[2] * u4)


def mode_response(nodes: FloatArray, h: float, substeps: int, rate: float, ratio: float) -> FloatArray:
    """Return q and q' (2, samples) of a mode from rest under `nodes` (steps of `h`, 3), at every `substeps`-th step."""
    angle = rate * h
    generator = np.zeros((5, 5))  # q, q' / rate, u and its derivatives, all over s = t / h
    generator[0, 1], generator[1, 0], generator[1, 1] = angle, -angle, -2.0 * ratio * angle
    generator[1, 2], generator[2, 3], generator[3, 4] = h / rate, 1.0, 1.0
    whole = expm(generator)
    step, push = whole[:2, :2], whole[:2, 2:] @ (PARABOLA * [[1.0], [1.0], [2.0]])
    weights, power = [], np.eye(2)
    for _ in range(substeps):  # of the last step before a sample first
        weights.append(power @ push)
        power = power @ step
    pushed = nodes.reshape(-1, 3 * substeps) @ np.hstack(weights[::-1]).T
    out = np.zeros((2, len(pushed) + 1))
    _turn(power, pushed, out)
    out[1] *= rate
    return out


@compiled
def _turn(step: Any, pushed: Any, out: Any) -> None:
    """Advance `out` (2, samples) from its first column on: out <- step out + pushed."""
    x, y = out[0, 0], out[1, 0]
    for i in range(pushed.shape[0]):
        before = x
        x = (pushed[i, 0] + step[0, 0] * before) + step[0, 1] * y
        y = (pushed[i, 1] + step[1, 0] * before) + step[1, 1] * y
        out[0, i + 1], out[1, i + 1] = x, y
