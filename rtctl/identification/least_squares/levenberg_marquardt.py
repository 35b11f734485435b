"""Levenberg-Marquardt within bounds on a cost whose normal equations are an arrow.

K. Madsen, H. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems (2004), algorithm 3.16. A trial
where the simulation diverges has infinite cost: it is rejected as any other that is worse. Evaluating gives the
derivatives as well: as lanes of the same simulation they cost less than a second one.

Along a narrow valley that is bent straight steps have to be short. Where one disappoints, the next ones follow the
bend: to the step is added half of the acceleration of the geodesic that it begins.
M. Transtrum, J. Sethna, Improvements to the Levenberg-Marquardt algorithm (2012), arXiv:1201.5885, section 4.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.least_squares.arrowhead_solver import LinAlgError, NormalEquations, solve_step


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
    local: FloatArray
    """(segments, q)"""


class Minimum(NamedTuple):
    """Where it ended."""

    unknowns: Unknowns
    equations: NormalEquations
    status: Status
    iterations: int


Evaluate = Callable[[Unknowns], NormalEquations | None]
SecondDerivative = Callable[[Unknowns, Unknowns], Unknowns | None]
"""At a point, along a step: J^T r'', where r'' is the residuals' second derivative along the step; None: unknown."""
POOR_GAIN_RATIO = 0.5
"""Of what the linear model promises of a step."""
MAX_ACCELERATION_RATIO = 0.75
"""Twice the acceleration over the step: beyond, a parabola is no better than a line."""
MIN_ACCELERATION_RATIO = 0.05
"""The same, below which the next step is not asked for its bend."""


def minimise(
    evaluate: Evaluate,
    start: Unknowns,
    low: FloatArray,
    high: FloatArray,
    *,
    iterations: int,
    tolerance: float = 1e-10,
    report: Callable[[int], None] = lambda iteration: None,
    should_stop: Callable[[], bool] = lambda: False,
    second_derivative: SecondDerivative = lambda here, move: None,
) -> Minimum | None:
    """From `start` until a step lowers the cost by less than `tolerance` of it; None: diverged at the start.

    `should_stop` is asked before each step: then it ends there, as if that had been the last of `iterations`.
    """
    here, equations = start, evaluate(start)
    if equations is None:
        return None
    damping, growth, bent = 1e-3, 2.0, False
    for iteration in range(iterations):
        if should_stop():
            return Minimum(here, equations, Status.ITERATIONS, iteration)
        report(iteration)
        if equations.cost == 0.0:
            return Minimum(here, equations, Status.CONVERGED, iteration)
        frozen = _find_active_bounds(here, equations, low, high)
        move = _solve_or_none(equations, damping, frozen)
        promised = _predict_reduction(equations, move) if move is not None else 0.0
        if bent and move is not None:
            move, bent = _add_acceleration(equations, damping, frozen, move, second_derivative(here, move))
        trial = _apply_step(here, move, low, high) if move is not None else None
        found = evaluate(trial) if trial is not None else None
        if trial is None or found is None or not found.cost <= equations.cost:
            if (
                trial is not None
                and found is not None
                and found.cost - equations.cost < tolerance * equations.cost
            ):
                return Minimum(here, equations, Status.CONVERGED, iteration + 1)
            damping, growth, bent = damping * growth, growth * 2.0, True
            if damping > 1e12:
                return Minimum(here, equations, Status.STUCK, iteration + 1)
            continue
        gained = equations.cost - found.cost
        done = gained <= tolerance * equations.cost and damping < 1.0
        bent = bent or gained < POOR_GAIN_RATIO * promised
        here, equations = trial, found
        if done:
            return Minimum(here, equations, Status.CONVERGED, iteration + 1)
        damping, growth = max(damping / 5.0, 1e-12), 2.0
    return Minimum(here, equations, Status.ITERATIONS, iterations)


def _solve_or_none(equations: NormalEquations, damping: float, frozen: NDArray[np.bool_]) -> Unknowns | None:
    """A damped step; None where there is none."""
    try:
        shared, own = solve_step(equations, damping, frozen)
    except (LinAlgError, ValueError):
        return None
    return Unknowns(shared, own) if np.isfinite(shared).all() and np.isfinite(own).all() else None


def _apply_step(here: Unknowns, move: Unknowns, low: FloatArray, high: FloatArray) -> Unknowns:
    """Cut at the bounds."""
    return Unknowns(np.clip(here.shared + move.shared, low, high), here.local + move.local)


def _predict_reduction(equations: NormalEquations, move: Unknowns) -> float:
    """What a step lowers the cost by in a linear model, at least."""
    return -0.5 * float(
        equations.shared_gradient @ move.shared + np.sum(equations.local_gradient * move.local)
    )


def _add_acceleration(
    equations: NormalEquations,
    damping: float,
    frozen: NDArray[np.bool_],
    move: Unknowns,
    second: Unknowns | None,
) -> tuple[Unknowns, bool]:
    """The step with half of its acceleration, as it is where that is too large; and whether it is bent at all."""
    if second is None:
        return move, True
    along = equations._replace(shared_gradient=second.shared, local_gradient=second.local)
    acceleration = _solve_or_none(along, damping, frozen)
    if acceleration is None:
        return move, True
    share = (
        2.0 * _compute_step_norm(equations, acceleration) / max(_compute_step_norm(equations, move), 1e-300)
    )
    if share > MAX_ACCELERATION_RATIO:
        return move, True
    added = Unknowns(move.shared + 0.5 * acceleration.shared, move.local + 0.5 * acceleration.local)
    return added, share > MIN_ACCELERATION_RATIO


def _compute_step_norm(equations: NormalEquations, move: Unknowns) -> float:
    """Norm of a step in the units of Marquardt's damping."""
    diagonal = np.einsum("kqq->kq", equations.diagonal)
    squares = np.diag(equations.shared) @ move.shared**2 + np.sum(diagonal * move.local**2)
    return float(np.sqrt(squares))


def predict_gain(found: Minimum, low: FloatArray, high: FloatArray) -> float:
    """What one more full step would lower the cost by in a linear model; 0 where there is none."""
    frozen = _find_active_bounds(found.unknowns, found.equations, low, high)
    move = _solve_or_none(found.equations, 0.0, frozen)
    gain = _predict_reduction(found.equations, move) if move is not None else 0.0
    return gain if np.isfinite(gain) else 0.0


def _find_active_bounds(
    here: Unknowns, equations: NormalEquations, low: FloatArray, high: FloatArray
) -> NDArray[np.bool_]:
    """(p,) which shared unknowns are at a bound that their gradient pushes them through."""
    pushed_down, pushed_up = equations.shared_gradient > 0.0, equations.shared_gradient < 0.0
    frozen: NDArray[np.bool_] = ((here.shared <= low) & pushed_down) | ((here.shared >= high) & pushed_up)
    return frozen
