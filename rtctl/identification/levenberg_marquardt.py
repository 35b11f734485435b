"""Levenberg-Marquardt within bounds on a cost whose normal equations are an arrow.

K. Madsen, H. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems (2004), algorithm 3.16. A trial
where the simulation diverges has infinite cost: it is rejected as any other that is worse. Evaluating gives the
derivatives as well: as lanes of the same simulation they cost less than a second one.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.identification.arrow import LinAlgError, NormalEquations, step

FloatArray = NDArray[np.float64]


class Status(StrEnum):
    """Why it ended, as advice."""

    CONVERGED = "converged"
    ITERATIONS = "stopped before it converged: start nearer (--model), or the data hardly determine it"
    STUCK = "no step lowers the cost: the start is on the edge of divergence or the model has a kink there"
    DIVERGED = "the model diverges at the start: give other start values"


class Unknowns(NamedTuple):
    """Scaled unknowns, all of order one."""

    shared: FloatArray
    """(p,)"""
    own: FloatArray
    """(segments, q)"""


class Minimum(NamedTuple):
    """Where it ended."""

    unknowns: Unknowns
    equations: NormalEquations
    status: Status
    iterations: int


Evaluate = Callable[[Unknowns], NormalEquations | None]


def minimise(
    evaluate: Evaluate,
    start: Unknowns,
    low: FloatArray,
    high: FloatArray,
    *,
    iterations: int,
    tolerance: float = 1e-10,
    told: Callable[[int], None] = lambda iteration: None,
    enough: Callable[[], bool] = lambda: False,
) -> Minimum | None:
    """From `start` until a step lowers the cost by less than `tolerance` of it; None: diverged at the start.

    `enough` is asked before each step: then it ends there, as if that had been the last of `iterations`.
    """
    here, equations = start, evaluate(start)
    if equations is None:
        return None
    damping, growth = 1e-3, 2.0
    for iteration in range(iterations):
        if enough():
            return Minimum(here, equations, Status.ITERATIONS, iteration)
        told(iteration)
        if equations.cost == 0.0:
            return Minimum(here, equations, Status.CONVERGED, iteration)
        trial = _trial(here, equations, damping, low, high)
        found = evaluate(trial) if trial is not None else None
        if trial is None or found is None or not found.cost <= equations.cost:
            if (
                trial is not None
                and found is not None
                and found.cost - equations.cost < tolerance * equations.cost
            ):
                return Minimum(here, equations, Status.CONVERGED, iteration + 1)
            damping, growth = damping * growth, growth * 2.0
            if damping > 1e12:
                return Minimum(here, equations, Status.STUCK, iteration + 1)
            continue
        gained = equations.cost - found.cost
        done = gained <= tolerance * equations.cost and damping < 1.0
        here, equations = trial, found
        if done:
            return Minimum(here, equations, Status.CONVERGED, iteration + 1)
        damping, growth = max(damping / 5.0, 1e-12), 2.0
    return Minimum(here, equations, Status.ITERATIONS, iterations)


def _trial(
    here: Unknowns, equations: NormalEquations, damping: float, low: FloatArray, high: FloatArray
) -> Unknowns | None:
    """A damped step, cut at the bounds; an unknown that its gradient pushes through its bound stays there."""
    try:
        shared, own = step(equations, damping, _pushed_out(here, equations, low, high))
    except (LinAlgError, ValueError):
        return None
    if not (np.isfinite(shared).all() and np.isfinite(own).all()):
        return None
    return Unknowns(np.clip(here.shared + shared, low, high), here.own + own)


def linear_gain(found: Minimum, low: FloatArray, high: FloatArray) -> float:
    """What one more full step would lower the cost by in a linear model; 0 where there is none."""
    equations = found.equations
    try:
        shared, own = step(equations, 0.0, _pushed_out(found.unknowns, equations, low, high))
    except (LinAlgError, ValueError):
        return 0.0
    gain = -0.5 * float(equations.shared_gradient @ shared + np.sum(equations.own_gradient * own))
    return gain if np.isfinite(gain) else 0.0


def _pushed_out(
    here: Unknowns, equations: NormalEquations, low: FloatArray, high: FloatArray
) -> NDArray[np.bool_]:
    """(p,) which shared unknowns are at a bound that their gradient pushes them through."""
    pushed_down, pushed_up = equations.shared_gradient > 0.0, equations.shared_gradient < 0.0
    frozen: NDArray[np.bool_] = ((here.shared <= low) & pushed_down) | ((here.shared >= high) & pushed_up)
    return frozen
