"""Levenberg-Marquardt within bounds, on a cost with arrowhead normal equations.

K. Madsen, H. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems (2004), algorithm 3.16. A trial
point where the simulation diverges has infinite cost and is rejected like any other that is worse. Every evaluation
returns the derivatives as well: as lanes of the same simulation they cost less than a second one.

Along a narrow, curved valley straight steps have to be short. After a step with a poor gain the next ones follow the
curve: half of the geodesic acceleration is added to the step.
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
    """Why the minimisation ended, worded as advice."""

    CONVERGED = "converged"
    ITERATIONS = "stopped before it converged: start nearer (--model), or the data hardly determine it"
    STUCK = "no step lowers the cost: the start is on the edge of divergence or the model has a kink there"
    DIVERGED = "the model diverges at the start: give other start values"


class Unknowns(NamedTuple):
    """Scaled unknowns, all of order one."""

    shared: FloatArray
    """Shared unknowns (p,)."""
    local: FloatArray
    """Local unknowns (segments, q): initial states and parameters of a record."""


class Minimum(NamedTuple):
    """The point where a minimisation ended."""

    unknowns: Unknowns
    equations: NormalEquations
    status: Status
    iterations: int


Evaluate = Callable[[Unknowns], NormalEquations | None]
SecondDerivative = Callable[[Unknowns, Unknowns], Unknowns | None]
"""Function of a point and a step: J^T r'', with r'' the residuals' second derivative along the step; None if unknown.

"""
POOR_GAIN_RATIO = 0.5
"""Share of the gain predicted by the linear model, below which a step counts as poor."""
MAX_ACCELERATION_RATIO = 0.75
"""Twice the acceleration over the step: above it a parabola is no better than a line."""
MIN_ACCELERATION_RATIO = 0.05
"""The same ratio, below which the acceleration is not computed for the next step."""


# nine parameters because each is one independent choice of a solver, and all but five have defaults
def minimise(  # noqa: PLR0913
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
    """Minimise from `start` until a step lowers the cost by less than `tolerance` of it.

    Args:
        evaluate: Returns the normal equations at a point, or None where the simulation diverges.
        start: Scaled unknowns to start from.
        low: (p,) lower bounds of the shared unknowns.
        high: (p,) upper bounds of the shared unknowns.
        iterations: Most steps that are tried.
        tolerance: Relative decrease of the cost below which the minimum has converged.
        report: Receives the number of each iteration.
        should_stop: Asked before each step; if true, that step is the last of `iterations`.
        second_derivative: Enables geodesic acceleration.

    Returns:
        The minimum, or None where the simulation diverges at the start.
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
    """Return a damped step, or None where the equations have no finite solution."""
    try:
        shared, own = solve_step(equations, damping, frozen)
    except (LinAlgError, ValueError):
        return None
    return Unknowns(shared, own) if np.isfinite(shared).all() and np.isfinite(own).all() else None


def _apply_step(here: Unknowns, move: Unknowns, low: FloatArray, high: FloatArray) -> Unknowns:
    """Return the point after a step, clipped at the bounds."""
    return Unknowns(np.clip(here.shared + move.shared, low, high), here.local + move.local)


def _predict_reduction(equations: NormalEquations, move: Unknowns) -> float:
    """Return the reduction of the cost that the linear model predicts for a step, at least."""
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
    """Add half of the geodesic acceleration to a step, unless it is too large; also return whether the path curves."""
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
    """Return the norm of a step in the units of Marquardt's damping."""
    diagonal = np.einsum("kqq->kq", equations.diagonal)
    squares = np.diag(equations.shared) @ move.shared**2 + np.sum(diagonal * move.local**2)
    return float(np.sqrt(squares))


def predict_gain(found: Minimum, low: FloatArray, high: FloatArray) -> float:
    """Return the reduction of the cost that a linear model predicts for one more full step; 0 without a step."""
    frozen = _find_active_bounds(found.unknowns, found.equations, low, high)
    move = _solve_or_none(found.equations, 0.0, frozen)
    gain = _predict_reduction(found.equations, move) if move is not None else 0.0
    return gain if np.isfinite(gain) else 0.0


def _find_active_bounds(
    here: Unknowns, equations: NormalEquations, low: FloatArray, high: FloatArray
) -> NDArray[np.bool_]:
    """Return which shared unknowns (p,) are at a bound that their gradient pushes them through."""
    pushed_down, pushed_up = equations.shared_gradient > 0.0, equations.shared_gradient < 0.0
    frozen: NDArray[np.bool_] = ((here.shared <= low) & pushed_down) | ((here.shared >= high) & pushed_up)
    return frozen
