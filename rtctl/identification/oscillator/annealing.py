"""Simulated annealing of a few coefficients: Algorithm 1 of the ME paper as it is meant, and as it is printed.

At temperature T a move x -> x + D of randomly chosen coefficients is accepted where the cost falls, and else with

    P = exp(-(f_new - f) / T),   T <- cooling T after `moves` moves                                     (3)

T_0 is the mean |f_new - f| of `pre_runs` times `moves` trials from the start. All `moves` of a temperature are
proposed around the point where it began, so that one call evaluates them together, and are judged in order.

`FAULTS` lists the corrections of the paper's Algorithm 1. Because steps that suit the start are far too coarse and
too isotropic for the end, the covariance of the moves follows the accepted ones (D. Vanderbilt, S. Louie, J. Comput.
Phys. 56, 259, 1984) and their size the accepted share (A. Corana et al., ACM Trans. Math. Software 13, 262, 1987).
`anneal_as_printed` runs the printed lines instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import BoolArray, FloatArray

Cost = Callable[[FloatArray], FloatArray]
"""Cost (n,) of parameter sets (n, p); infinite where the model cannot run."""

FAULTS = (
    "Line 7 takes a move where f rises: right for a correlation, the opposite of what is wanted for an error "
    "(peak-to-peak, peak index), which it then drives up.",
    "Line 12 takes a worse move where a random number exceeds exp(-df/kT): the test is inverted. With df as printed "
    "(new minus old) the exponential is above 1 for every move that line 7 has refused, so none is ever taken: the "
    "printed algorithm does not anneal.",
    "Line 23 cools to alpha T_0 and stays there: the product is not cumulative.",
    "Lines 8, 13 and 16 keep one f_best, which an accepted worse move overwrites: the best that was seen is lost.",
    "Line 20 turns the sign of all steps at once: two coefficients that must move against each other (damping and "
    "stiffness) never can in one move.",
    "Lines 4 to 22 keep one step size: as large as the start needs, it is too coarse to converge.",
)
TARGET_SHARE = (0.2, 0.4)
"""Share of accepted moves between which the step size stays."""
STEP_CHANGE = 1.15
MIN_STEP, MAX_STEP = 1e-9, 0.5
"""Limits of the step size relative to a coefficient's range."""
COVARIANCE_GAIN = 0.15
"""Weight of one temperature's accepted moves in the covariance of the next ones."""
MIN_VARIANCE = 1e-14


@dataclass(frozen=True, slots=True, kw_only=True)
class AnnealingOptions:
    """Options of the annealing; the paper's numbers are the defaults where it gives any."""

    temperatures: int = 300
    moves: int = 30
    """Moves at each temperature."""
    cooling: float = 0.9
    first_step: float = 0.1
    """Largest change of the first moves relative to a coefficient's range."""
    pre_runs: int = 5
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.temperatures > 0 and self.moves > 0 and self.pre_runs > 0):
            raise ValueError(
                f"temperatures, moves and pre_runs must be > 0, got {self.temperatures!r}, {self.moves!r}, "
                f"{self.pre_runs!r}"
            )
        for name in ("cooling", "first_step"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"{name} must lie in (0, 1), got {getattr(self, name)!r}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnnealingResult:
    """The result of an annealing and its course."""

    values: FloatArray
    """Best point (p,); as printed, the last one accepted."""
    cost: float
    first_temperature: float
    best: FloatArray
    """Lowest cost so far (temperatures,); as printed, the current one."""
    taken: FloatArray
    """Share of moves (temperatures,) that were acceptable from the point where the temperature began."""
    evaluations: int


def anneal(
    cost: Cost, start: FloatArray, low: FloatArray, high: FloatArray, options: AnnealingOptions | None = None
) -> AnnealingResult:
    """Minimise `cost` within bounds from `start`.

    Args:
        cost: Cost of parameter sets.
        start: (p,) start.
        low: (p,) lower bounds.
        high: (p,) upper bounds.
        options: Temperatures, moves and steps.

    Raises:
        ValueError: The start has no finite cost.
    """
    options = options or AnnealingOptions()
    rng = np.random.default_rng(options.seed)
    x, width = np.asarray(start, dtype=np.float64), high - low
    f = _evaluate_start(cost, x, low, high)
    shape, step = np.eye(len(x)), options.first_step
    trials = [_propose_moves(rng, x, step * shape, low, high, options.moves) for _ in range(options.pre_runs)]
    temperature = first = _compute_mean_change(cost(np.vstack(trials)), f)
    best, best_f = x, f
    course, taken = np.empty(options.temperatures), np.empty(options.temperatures)
    for turn in range(options.temperatures):
        centre, f_centre = x, f
        moves = _propose_moves(rng, x, step * _compute_root(shape), low, high, options.moves)
        costs, chances = cost(moves), rng.random(options.moves)
        good = chances < np.exp(-np.maximum(costs - f_centre, 0.0) / temperature)
        for move, found, chance in zip(moves, costs.tolist(), chances.tolist(), strict=True):
            if found <= f or chance < math.exp(-(found - f) / temperature):
                x, f = move, found
                if f < best_f:
                    best, best_f = x, f
        course[turn], taken[turn] = best_f, good.mean()
        if good.any():
            gone = (moves[good] - centre) / width / step
            shape = (1.0 - COVARIANCE_GAIN) * shape + COVARIANCE_GAIN * gone.T @ gone / len(gone)
        step = _adapt_step(step, taken[turn])
        temperature *= options.cooling
    evaluations = 1 + options.moves * (options.pre_runs + options.temperatures)
    return AnnealingResult(
        values=best, cost=best_f, first_temperature=first, best=course, taken=taken, evaluations=evaluations
    )


def anneal_as_printed(
    score: Cost, start: FloatArray, low: FloatArray, high: FloatArray, options: AnnealingOptions | None = None
) -> AnnealingResult:
    """Run lines 1 to 25 as printed, one move a call.

    Args:
        score: The paper's f itself: the correlation, or an error.
        start: (p,) start.
        low: (p,) lower bounds.
        high: (p,) upper bounds.
        options: Temperatures, moves and steps.
    """
    options = options or AnnealingOptions()
    rng = np.random.default_rng(options.seed)
    x, width = np.asarray(start, dtype=np.float64), high - low
    f = _evaluate_start(score, x, low, high)
    even = options.first_step * np.eye(len(x))
    trials = [_propose_moves(rng, x, even, low, high, options.moves) for _ in range(options.pre_runs)]
    first = _compute_mean_change(score(np.vstack(trials)), f)
    temperature, sign = first, 1.0
    course, taken = np.empty(options.temperatures), np.empty(options.temperatures)
    for turn in range(options.temperatures):
        changes: list[float] = []
        accepted = 0
        for i in range(options.moves):
            chosen = _choose_coefficients(rng, len(x), 1)[0]
            move = np.clip(x + sign * options.first_step * width * chosen * rng.random(len(x)), low, high)
            found = float(score(move[None, :])[0])
            changes.append(found - f)
            if found > f or rng.random() > _exponentiate(-(found - f) / temperature):
                x, f, accepted = move, found, accepted + 1
            if i + 1 > 5 and abs(changes[i]) >= abs(changes[i - 2]):
                sign = -sign
        course[turn], taken[turn] = f, accepted / options.moves
        temperature = options.cooling * first
    evaluations = 1 + options.moves * (options.pre_runs + options.temperatures)
    return AnnealingResult(
        values=x, cost=f, first_temperature=first, best=course, taken=taken, evaluations=evaluations
    )


def _evaluate_start(cost: Cost, x: FloatArray, low: FloatArray, high: FloatArray) -> float:
    if not ((low <= x) & (x <= high)).all() or not (low < high).all():
        raise ValueError("annealing needs low < high for each coefficient, and a start between them")
    f = float(cost(x[None, :])[0])
    if not math.isfinite(f):
        raise ValueError(f"the start's cost is {f!r}: start where the model runs")
    return f


def _choose_coefficients(rng: np.random.Generator, coefficients: int, moves: int) -> BoolArray:
    """Draw which coefficients each move changes (moves, p): half of them on average, at least one."""
    chosen = rng.random((moves, coefficients)) < 0.5
    chosen[np.arange(moves), rng.integers(coefficients, size=moves)] = True
    return chosen


def _propose_moves(
    rng: np.random.Generator, x: FloatArray, root: FloatArray, low: FloatArray, high: FloatArray, moves: int
) -> FloatArray:
    """Propose points (moves, p) around x: steps in some of the directions of `root` (p, p), relative to the range.

    Steps are reflected at the bounds: clipped ones would pile up there.
    """
    steps = rng.standard_normal((moves, len(x))) * _choose_coefficients(rng, len(x), moves)
    found = x + (high - low) * (steps @ root.T)
    found = np.where(found < low, 2.0 * low - found, found)
    return np.asarray(np.clip(np.where(found > high, 2.0 * high - found, found), low, high))


def _compute_root(shape: FloatArray) -> FloatArray:
    """Return the principal axes of the moves' covariance, each scaled to its standard deviation."""
    power, axes = np.linalg.eigh(shape)
    return np.asarray(axes * np.sqrt(np.maximum(power, MIN_VARIANCE)))


def _compute_mean_change(costs: FloatArray, f: float) -> float:
    """Return T_0: mean |df| of the trials that have a cost; a smallest number where none differs."""
    changes = np.abs(costs[np.isfinite(costs)] - f)
    return max(float(changes.mean()) if len(changes) else 0.0, 1e-300)


def _adapt_step(step: float, share: float) -> float:
    """Return the step size of the next temperature."""
    if share > TARGET_SHARE[1]:
        return min(step * STEP_CHANGE, MAX_STEP)
    return max(step / STEP_CHANGE, MIN_STEP) if share < TARGET_SHARE[0] else step


def _exponentiate(argument: float) -> float:
    return math.exp(argument) if argument < 700.0 else math.inf
