"""Candidates from a regression on the measured motion: what a linear step from a model that misses it cannot tell.

A nominal model that leaves a large part of the motion is elsewhere than the device, and so are the forces along its
motion: a cubic spring that stands in for a stop lets the stop's own fit end in a local minimum. Along the measured
motion each mechanism's force is known for each choice of its shapes, and the weak form of the equation of motion is
linear in all amplitudes and nominal coefficients (a change of the drive acts by the gain, which is solved for too: its
amplitude follows from both). Its least squares have one minimum. In sweeps the fundamental is balanced instead: where a
response folds, a model that misses the motion ends, and a linear step along it says nothing at all.

Reference: S. F. Masri, T. K. Caughey, J. Appl. Mech. 46 (1979) 433 (restoring forces from measured motion); the rows
are those of `rtctl.identification.regression.equation_rows`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from scipy.optimize import fmin

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Mechanism
from rtctl.border.simulation import FreeParameter, HasForces
from rtctl.border.work import count_work
from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import (
    ALL,
    Direction,
    group_by_shapes,
    lanes_along,
    parameters_by_name,
)
from rtctl.diagnosis.residual.projection import solve_least_squares
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.proposals.candidates import candidate_at
from rtctl.diagnosis.search.successive_halving import Candidate
from rtctl.identification.regression.equation_rows import EquationRows, RowsInTime, RowsOfSweep
from rtctl.identification.regression.initial_state import estimate_initial_state
from rtctl.identification.regression.weak_form import TERMS, choose_half_width

ABSURD = 1e100
"""Magnitude above which a force is dropped: its states were unstable at these steps."""
CONSTANT = "offset"
"""Term of any constant force, which a gravity or a reading's zero leaves."""
GAIN = "drive_gain"
STEP_WORK = 0.2
"""Work of a force at one sample, in steps of a simulation."""


class Regressed(NamedTuple):
    """The equation of motion solved along some directions."""

    directions: tuple[Direction, ...]
    nominal: FloatArray
    """Coefficients of the nominal terms that are free; 0 of one that nothing in the records shows."""
    steps: FloatArray
    """(g,) steps along the directions, in their scales."""
    left: float
    """Share of the acceleration's squares that is left beyond the noise."""

    @property
    def mechanisms(self) -> frozenset[str]:
        """Ids of the mechanisms."""
        return frozenset(one.mechanism for one in self.directions)


class Regressions(NamedTuple):
    """Starts that explain a measured motion, best first."""

    singles: tuple[Candidate, ...] = ()
    """Sets of one mechanism."""
    pairs: tuple[Candidate, ...] = ()
    """Sets of two."""
    judged: frozenset[str] = frozenset()
    """Mechanisms of which the regression alone decides whether they are tried: those with forces along a sweep.

    Along records in time the readings' noise biases a regression, and linear steps are tried beside it.
    """


NO_REGRESSIONS = Regressions()


class Regression:
    """The weak form of a nominal model's equation of motion along measured motions, beside the forces of mechanisms."""

    def __init__(self, hypothesis: Hypothesis, problem: Problem, directions: Sequence[Direction]) -> None:
        """Take all forces along the motions.

        Args:
            hypothesis: Fitted nominal model.
            problem: Records with measured motions.
            directions: Directions of mechanisms; those that are no forces are left out.
        """
        self.hypothesis, self.problem = hypothesis, problem
        self.half_width_s = choose_half_width(problem.records, problem.scales.rate)
        nominal = [one for one in hypothesis.simulation.parameters if one.name in TERMS and not one.mechanism]
        values = {one.name: one.value for one in nominal}
        steady = problem.subject.is_steady
        self.rows: list[EquationRows] = [
            RowsOfSweep(record, values) if steady else RowsInTime(record, self.half_width_s)
            for record in problem.records
        ]
        reference = self.rows[0].reference
        self.names = [*(one.name for one in nominal if not one.fixed), *(() if steady else (CONSTANT,))]
        self.reference = np.array([reference.get(name, 0.0) for name in self.names])
        known = {one.name: one.value - reference.get(one.name, 0.0) for one in nominal if one.fixed}
        found = [self._forces(directions, index) for index in range(len(problem.records))]
        kept = sorted(found[0])
        self.directions = [directions[k] for k in kept]
        """Directions (k) that are forces."""
        whole, noise = self._sum_up(known, [np.array([forces[k] for k in kept]) for forces in found])
        self._gram = _without_known(whole, known)
        self.noise = noise / max(float(self._gram[0, 0]), 1e-300)
        """Share of the acceleration's squares that is noise."""

    def _sum_up(self, known: Mapping[str, float], forces: Sequence[FloatArray]) -> tuple[FloatArray, float]:
        names = [*known, *self.names]
        parts = [rows.gram(names, own) for rows, own in zip(self.rows, forces, strict=True)]
        return np.sum([gram for gram, _ in parts], axis=0), sum(noise for _, noise in parts)

    def _forces(self, directions: Sequence[Direction], index: int) -> dict[int, FloatArray]:
        """Return the force per mass along a measured motion, per unit step, of directions that are forces."""
        rows, step = self.rows[index], self.problem.thresholds.search.regressed_step
        model = self.hypothesis.simulation
        assert isinstance(model, HasForces)
        self.problem.cancellation.raise_if_cancelled()
        count_work(STEP_WORK * len(directions) * rows.samples)
        found: dict[int, FloatArray] = {}
        for (name, _), same in groupby(range(len(directions)), key=lambda k: _law(directions[k])):
            own = list(same)
            extended = model.extended((name,))
            lanes = lanes_along(self.hypothesis, extended, [directions[k] for k in own], index, step)
            with np.errstate(all="ignore"):
                forces = rows.forces(model, extended, lanes[1:])
            if forces is not None:
                bounded = (np.abs(forces) < ABSURD).all(axis=1, keepdims=True)
                found.update(zip(own, np.where(bounded, forces, 0.0) / step, strict=True))
        return found

    def groups(self) -> list[list[int]]:
        """Return the directions that act together, without those that nominal terms nearly are."""
        terms, scale = slice(1, 1 + len(self.names)), np.sqrt(np.maximum(np.diag(self._gram), 1e-300))
        normal = self._gram / scale[:, None] / scale
        across = normal[terms.stop :, terms]
        followed = across @ np.linalg.pinv(normal[terms, terms], rcond=1e-12, hermitian=True)
        visible = np.diag(normal)[terms.stop :] - np.sum(followed * across, axis=1)
        usable = np.flatnonzero(visible > self.problem.thresholds.search.regressed_visible).tolist()
        return group_by_shapes(self.directions, usable)

    def solve(self, group: Sequence[int] = ()) -> Regressed:
        """Solve for the nominal coefficients and the steps along directions."""
        count = len(self.names)
        chosen = [*range(1, 1 + count), *(1 + count + k for k in group)]
        solved, _ = solve_least_squares(self._gram[np.ix_([0, *chosen], [0, *chosen])])
        left = 1.0 - float(self._gram[chosen, 0] @ solved) / max(float(self._gram[0, 0]), 1e-300)
        along = tuple(self.directions[k] for k in group)
        nominal = self.reference + solved[:count]
        return Regressed(along, nominal, self._rescaled(along, nominal, solved[count:]), max(left, 0.0))

    def _rescaled(
        self, directions: Sequence[Direction], nominal: FloatArray, solved: FloatArray
    ) -> FloatArray:
        """Return the steps; a change of the drive acts by the gain that was solved for, not by the model's."""
        gains = [one.value for one in self.hypothesis.simulation.parameters if one.name == GAIN]
        steps: FloatArray = solved.copy()
        if not gains or GAIN not in self.names or nominal[self.names.index(GAIN)] == 0.0:
            return steps
        ratio = gains[0] / nominal[self.names.index(GAIN)]
        for k, direction in enumerate(directions):
            steps[k] *= ratio if self.law_of(direction.mechanism).acts_before_the_equation else 1.0
        return steps

    def is_possible(self, one: Regressed) -> bool:
        """Return whether all amplitudes are within their bounds."""
        for direction, step in zip(one.directions, one.steps, strict=True):
            amplitude = _parameters(self.hypothesis, direction)[direction.name]
            if not amplitude.low <= amplitude.value + step * direction.scale <= amplitude.high:
                return False
        return True

    def law_of(self, identity: str) -> Mechanism:
        """Return a mechanism of the catalogue."""
        return self.hypothesis.simulation.extended((identity,)).mechanisms[-1]

    def possible(self, groups: Sequence[Sequence[int]]) -> list[Regressed]:
        """Return the possible solutions, the best shapes of each set of mechanisms, what leaves least first."""
        solved = sorted((self.solve(group) for group in groups), key=lambda one: one.left)
        best: dict[frozenset[str], Regressed] = {}
        for one in solved:
            if one.mechanisms not in best and self.is_possible(one):
                best[one.mechanisms] = one
        return list(best.values())

    def refined(self, one: Regressed) -> tuple[Direction, ...]:
        """Return the directions of one mechanism at the shapes that leave least, near those of the grid."""
        first = one.directions[0]
        known = _parameters(self.hypothesis, first)
        moving = [name for name in first.shapes if not _stays(known[name], first.shapes[name])]
        if not moving:
            return one.directions
        sizes = np.array([abs(first.shapes[name]) or 1.0 for name in moving])

        def at(moved: FloatArray) -> tuple[Direction, ...]:
            values = {
                name: float(np.clip(first.shapes[name] + size * by, known[name].low, known[name].high))
                for name, size, by in zip(moving, sizes, moved, strict=True)
            }
            shapes = {**first.shapes, **values}
            return tuple(direction._replace(shapes=shapes) for direction in one.directions)

        def left(moved: FloatArray) -> float:
            trial = Regression(self.hypothesis, self.problem, at(moved))
            return trial.solve(range(len(trial.directions))).left

        most = self.problem.thresholds.search.regressed_trials
        simplex = np.vstack((np.zeros(len(moving)), 0.15 * np.eye(len(moving))))
        found = fmin(
            left, np.zeros(len(moving)), xtol=1e-2, ftol=1e-9, maxfun=most * len(moving),
            initial_simplex=simplex, disp=False,
        )  # fmt: skip
        return at(np.asarray(found))


def propose_by_regression(parent: TestedHypothesis, problem: Problem) -> Regressions:
    """Return the nominal model with one mechanism, and with two, that explain the measured motion best.

    Returns:
        Best first; none where the nominal model follows the motion of records in time, has mechanisms, or is no
        equation of motion.
    """
    hypothesis, limits, steady = parent.hypothesis, problem.thresholds.search, problem.subject.is_steady
    close = problem.thresholds.nominal_fit.close_misfit
    follows = not steady and relative_misfit(problem, hypothesis) < close
    if follows or hypothesis.mechanisms or not isinstance(hypothesis.simulation, HasForces):
        return NO_REGRESSIONS
    part = problem.glance if steady else problem.initial_part(limits.regressed_samples)
    grid = [one for one in parent.directions if one.mechanism and one.record == ALL]
    regression = Regression(hypothesis, part, grid)
    leaders = regression.possible(regression.groups())[: limits.regressed_refined]
    refined = [
        direction
        for one in leaders
        for direction in regression.refined(one)
        if direction not in one.directions
    ]
    regression = Regression(hypothesis, part, [*grid, *refined])
    alone, groups = regression.solve(), regression.groups()
    if alone.left < limits.regressed_share * regression.noise:
        return NO_REGRESSIONS
    singles = regression.possible(groups)
    tried = singles[: limits.regressed_tried]
    pairs = regression.possible([pair for one in tried for pair in _beside(regression, one, groups)])
    least = min([alone.left, *(one.left for one in tried)])

    def started(found: Sequence[Regressed], below: float) -> tuple[Candidate, ...]:
        worth = [one for one in found[: limits.regressed_tried] if one.left < limits.regressed_share * below]
        return tuple(_candidate(parent, problem, regression, one) for one in worth)

    found = started(singles, alone.left)
    judged = frozenset(one.mechanism for one in regression.directions) if steady and found else frozenset()
    return Regressions(found, started(pairs, least), judged)


def _beside(regression: Regression, one: Regressed, groups: Sequence[list[int]]) -> list[list[int]]:
    """Return the directions of `one` beside each group of a mechanism that is no case of its law."""
    own = [k for k, direction in enumerate(regression.directions) if direction in one.directions]
    laws = {name: regression.law_of(name) for name in {each.mechanism for each in regression.directions}}
    first = laws[one.directions[0].mechanism]
    names = [regression.directions[group[0]].mechanism for group in groups]
    return [
        [*own, *group]
        for name, group in zip(names, groups, strict=True)
        if laws[name].id != first.id and not laws[name].is_related_to(first)
    ]


def _candidate(
    parent: TestedHypothesis, problem: Problem, regression: Regression, one: Regressed
) -> Candidate:
    """Return the set at the values of the regression, from the measured states where a displacement shows them."""
    hypothesis = parent.hypothesis
    simulation, sensitivity = hypothesis.simulation, hypothesis.sensitivity
    values = {name: value for name, value in zip(regression.names, one.nominal, strict=True) if value != 0.0}
    free = [simulation.parameters[k] for k in sensitivity.free]
    room = np.array([values.get(p.name, p.value) - p.value for p in free]) / sensitivity.scale
    along = parent._replace(directions=one.directions)
    fitted = np.ones(len(one.directions), dtype=bool)
    candidate = candidate_at(along, range(len(one.directions)), one.steps, room, 1.0, fitted)
    starts = candidate.starts.copy()
    for index, record in enumerate(problem.records):
        if hypothesis.states and record.first == 0 and "displacement" in record.measured:
            state = estimate_initial_state(record, 0, regression.half_width_s, simulation.state)
            starts[index, : hypothesis.states] = state
    return candidate._replace(starts=starts)


def _without_known(gram: FloatArray, known: Mapping[str, float]) -> FloatArray:
    """Return the Gram matrix of the acceleration less what is known, free terms and forces.

    Args:
        gram: That of the acceleration, the known terms, the free ones and the forces.
        known: Coefficients of the known terms.
    """
    count = len(known)
    mixed = np.zeros((len(gram), len(gram) - count))
    mixed[: 1 + count, 0] = [1.0, *(-value for value in known.values())]
    mixed[1 + count :, 1:] = np.eye(len(gram) - count - 1)
    kept: FloatArray = mixed.T @ gram @ mixed
    return kept


def _law(direction: Direction) -> tuple[str, str]:
    return direction.mechanism, direction.form


def _parameters(hypothesis: Hypothesis, direction: Direction) -> dict[str, FreeParameter]:
    extended = hypothesis.simulation.extended((direction.mechanism,))
    return parameters_by_name(extended, direction.mechanism)


def _stays(parameter: FreeParameter, value: float) -> bool:
    """Return whether a shape stays where it is until the rest is known."""
    declared = parameter.declared
    return declared.default is not None or declared.redundant or declared.stays_at(value)
