"""Successive halving: few iterations from every start, more for the better half, the best sets to the end.

The first round leaves work for the others: the best set is worth nothing before its fit has ended, and the starts that
are left out then are further ones of sets that had one, or those of the weakest mechanisms. Where a subject asks for
it, the early rounds fit the initial part of the records only (`Problem.glance`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.basin_search import search_basins
from rtctl.diagnosis.nominal_fit.initial_states import improve_initial_states
from rtctl.diagnosis.problem.fit import fit_hypothesis, polish, predict_with_free_shapes
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.model_selection import best_of_each_set
from rtctl.diagnosis.thresholds import SearchThresholds

Key = tuple[frozenset[str], str]
"""A set, and the form of what was added to it."""


class Candidate(NamedTuple):
    """Start of a fit."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    """Model at the values where the fit starts."""
    starts: FloatArray
    """Initial states and parameters of each record (records, ...), in units."""
    fixed_parameters: frozenset[str]
    """Names of parameters that are not fitted."""
    neutral: Simulation
    """The same model where the added mechanism does not act."""
    parent: Hypothesis
    """Set that is extended: a fit that ends above its cost went astray."""
    form: str = ""
    """Form of the added mechanism; forms are rivals to the end."""

    def shortened(self, factor: float) -> Candidate:
        """Return the candidate at `factor` times the step away from its parent."""
        values, neutral = (
            np.array([one.value for one in simulation.parameters])
            for simulation in (self.simulation, self.neutral)
        )
        starts = factor * self.starts
        starts[:, : self.parent.starts.shape[1]] += (1.0 - factor) * self.parent.starts
        return self._replace(
            simulation=self.simulation.with_values(neutral + factor * (values - neutral)), starts=starts
        )


def halve_successively(
    problem: Problem,
    candidates: Sequence[Candidate],
    report: Callable[[str], None],
    budget: WorkBudget | None = None,
) -> list[Hypothesis]:
    """Fit all candidates a little and the best ones to the end.

    Args:
        problem: Records to fit.
        candidates: Starts, in the order in which they are fitted.
        report: Called with the names of each set before its fit.
        budget: Work after which no further fit begins; None: no limit.

    Returns:
        The best fit of each set, lowest cost first; the first ones are fitted to the end, and to all samples.

    Raises:
        CancelledError: Between two fits, once the problem's cancellation token is set.
    """
    return best_of_each_set(fit_in_rounds(problem, candidates, report, budget or WorkBudget.of(np.inf)))


def fit_in_rounds(
    problem: Problem, candidates: Sequence[Candidate], report: Callable[[str], None], budget: WorkBudget
) -> list[Hypothesis]:
    """Return the best fit of each form of each set, as `halve_successively` does."""
    problem = problem.until(budget)
    initial, limits = problem.glance, problem.thresholds.search
    starting = budget.further(limits.first_round_share * budget.left)
    fits = _fit_starts(initial, candidates, report, starting, whole=initial is problem)
    leaders = _fit_second_round(initial, fits, budget)
    field = _sort_by_cost(leaders.values())
    finalists = _select_in_reach(field, limits.finalists, limits)
    finalists += select_other_forms(field, finalists, limits)
    finalists += select_by_free_shapes(initial, field, finalists, budget)
    if initial is not problem:  # costs of few samples and of all cannot be compared
        return _finish_on_all_samples(problem, candidates, finalists, budget)
    finished = _finish(problem, finalists, budget)
    return _sort_by_cost([*finished, *(one for one in field if not _is_among(one, finalists))])


def _fit_starts(
    problem: Problem,
    candidates: Sequence[Candidate],
    report: Callable[[str], None],
    budget: WorkBudget,
    *,
    whole: bool,
) -> dict[Key, list[Hypothesis]]:
    """Fit every start a few iterations; `whole`: the parents were fitted to the same records."""
    fits: dict[Key, list[Hypothesis]] = {}
    parent_costs: dict[int, float] = {}
    fair = budget.left / max(len({(frozenset(one.mechanisms), one.form) for one in candidates}), 1)
    for candidate in candidates:
        if budget.spent:
            break
        report(" + ".join(candidate.mechanisms))
        if (
            problem.subject.is_steady
        ):  # whose steps a period differ by twenty: two sets left no work for the others
            problem = problem.until(budget.further(fair))
        problem.cancellation.raise_if_cancelled()
        parent = candidate.parent
        if id(parent) not in parent_costs:
            parent_costs[id(parent)] = parent.cost if whole else _evaluate_cost(problem, parent)
        fit = _fit_no_worse(problem, candidate, parent_costs[id(parent)])
        if fit is not None:
            fits.setdefault((frozenset(candidate.mechanisms), candidate.form), []).append(fit)
    return fits


def _fit_second_round(
    problem: Problem, fits: Mapping[Key, Sequence[Hypothesis]], budget: WorkBudget
) -> dict[Key, Hypothesis]:
    """Fit the better half, and those that promise more than any of it, some iterations further."""
    limits = problem.thresholds.search
    leaders = {key: min(ones, key=_cost) for key, ones in fits.items()}
    ahead = _select_in_reach(_sort_by_cost(leaders.values()), limits.second_round, limits)
    going = {key: one for key, one in leaders.items() if _is_among(one, ahead)}
    least = min((one.predicted_cost for one in ahead), default=np.inf)
    going |= select_promising({key: ones for key, ones in fits.items() if key not in going}, least, limits)
    for key, one in sorted(going.items(), key=lambda item: item[1].cost):
        if not budget.spent:
            leaders[key] = min(leaders[key], _fit_further(problem, one), key=_cost)
    return leaders


def _finish(problem: Problem, finalists: Sequence[Hypothesis], budget: WorkBudget) -> list[Hypothesis]:
    """Fit the finalists to the end, those in contention further while they descend, and the leaders across kinks."""
    limits = problem.thresholds.search
    fits = [one if budget.spent else _polish_to_end(problem, one) for one in finalists]
    for _ in range(limits.further_rounds):
        least = min((one.cost for one in fits), default=0.0)
        descending = [
            is_in_contention(one, least, limits)
            and one.predicted_cost < (1.0 - limits.converged_share) * one.cost
            for one in fits
        ]
        if not any(descending):
            break
        fits = [
            _polish_to_end(problem, one) if further and not budget.spent else one
            for one, further in zip(fits, descending, strict=True)
        ]
    near = limits.leading_cost * min((one.cost for one in fits), default=0.0)
    return [search_basins(problem, one) if one.cost < near and not budget.spent else one for one in fits]


def _finish_on_all_samples(
    problem: Problem, candidates: Sequence[Candidate], finalists: Sequence[Hypothesis], budget: WorkBudget
) -> list[Hypothesis]:
    """Fit the first finalists to the end and to all samples, and slow mechanisms beside them, whatever these leave."""
    count = problem.thresholds.search.finalists_on_all_samples
    fits = [_fit_all_samples(problem, one) for one in finalists[:count]]
    finished = [one for one in fits if one is not None]
    problem = problem.until(budget.further(budget.thresholds.rivals))
    return _sort_by_cost([*finished, *_fit_slow_mechanisms(problem, candidates, finished)])


def _fit_start(problem: Problem, candidate: Candidate) -> Hypothesis | None:
    iterations = problem.thresholds.search.first_iterations
    return fit_hypothesis(
        problem,
        candidate.simulation,
        candidate.mechanisms,
        candidate.starts,
        iterations,
        fixed_parameters=candidate.fixed_parameters,
    )


def _evaluate_cost(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the cost on these records of a hypothesis fitted to more of them; infinite where it diverges."""
    same = _refit(problem, hypothesis, 0)
    return np.inf if same is None else same.cost


def _refit(problem: Problem, hypothesis: Hypothesis, iterations: int) -> Hypothesis | None:
    return fit_hypothesis(
        problem,
        hypothesis.simulation,
        hypothesis.mechanisms,
        hypothesis.starts,
        iterations,
        fixed_parameters=hypothesis.fixed_parameters,
    )


def _fit_no_worse(problem: Problem, candidate: Candidate, most: float) -> Hypothesis | None:
    """Fit a start; with a shorter step, at last with none, where that ends above its parent's cost `most`."""
    best = _fit_start(problem, candidate)
    for factor in problem.thresholds.search.shorter_steps:
        if best is not None and best.cost <= most:
            break
        fit = _fit_start(problem, candidate.shortened(factor))
        best = min((one for one in (best, fit) if one is not None), key=_cost, default=None)
    return best


def _polish_to_end(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """Fit from the initial states that suit each record best, with every shape that the records determine."""
    hypothesis = improve_initial_states(problem, hypothesis)
    return _lower(hypothesis, polish(problem, hypothesis, problem.thresholds.search.last_iterations))


def _fit_all_samples(problem: Problem, hypothesis: Hypothesis) -> Hypothesis | None:
    """Fit to the end on the initial part of the records, then to all samples."""
    end = search_basins(problem.glance, _polish_to_end(problem.glance, hypothesis))
    return _refit(problem, end, problem.thresholds.search.first_iterations)


def _fit_slow_mechanisms(
    problem: Problem, candidates: Sequence[Candidate], finished: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Fit the best parent's set with each slow mechanism to all samples, to its end where it is near the best.

    What grows with time (a drift, ageing, creep) does next to nothing in the initial part of the records.
    """
    limits = problem.thresholds.search
    slow: list[tuple[str, Candidate]] = []
    for candidate in candidates:
        added = [one for one in candidate.simulation.mechanisms if one.id not in candidate.parent.mechanisms]
        if len(added) == 1 and added[0].slow:
            slow.append((added[0].id, candidate))
    least = min((candidate.parent.cost for _, candidate in slow), default=0.0)
    first = {name: candidate for name, candidate in slow[::-1] if candidate.parent.cost == least}
    fits = [
        one for one in (_fit_no_worse(problem, each, least) for each in first.values()) if one is not None
    ]
    least = min((one.cost for one in (*finished, *fits)), default=0.0)
    near = [one.cost < limits.contending_cost * least for one in fits]
    return [
        _lower(one, polish(problem, one, limits.second_iterations)) if further else one
        for one, further in zip(fits, near, strict=True)
    ]


def is_in_contention(hypothesis: Hypothesis, least: float, limits: SearchThresholds) -> bool:
    """Return whether a finalist may still end near the lowest cost `least`."""
    promising = hypothesis.predicted_cost < least
    most = limits.contending_cost_if_promising if promising else limits.contending_cost
    return hypothesis.cost < most * least


def _select_in_reach(field: Sequence[Hypothesis], most: int, limits: SearchThresholds) -> list[Hypothesis]:
    return [one for one in field[:most] if one.cost <= limits.hopeless_cost * field[0].cost]


def select_other_forms(
    field: Sequence[Hypothesis], finalists: Sequence[Hypothesis], limits: SearchThresholds
) -> list[Hypothesis]:
    """Select further forms of the finalists' sets.

    Another form may need a shape that is still at its default, and is far behind until that moves.
    """
    sets = [frozenset(one.mechanisms) for one in finalists]
    others = (one for one in field if not _is_among(one, finalists) and frozenset(one.mechanisms) in sets)
    near = (one for one in others if one.cost < limits.other_form_cost * finalists[0].cost)
    return list(near)[: limits.other_forms]


def select_by_free_shapes(
    problem: Problem, field: Sequence[Hypothesis], finalists: Sequence[Hypothesis], budget: WorkBudget
) -> list[Hypothesis]:
    """Select the further sets that promise less than every finalist once shapes at their defaults are free.

    A second mode of the wrong damping is behind four laws of damping that all fit the same part of the residual.
    """
    limits = problem.thresholds.search
    least = min((one.predicted_cost for one in finalists), default=0.0)
    near = [
        one
        for one in field
        if not _is_among(one, finalists)
        and one.cost < limits.contending_cost_if_promising * finalists[0].cost
    ]
    promised = [(np.inf if budget.spent else predict_with_free_shapes(problem, one), one) for one in near]
    promised.sort(key=lambda pair: pair[0])
    return [one for cost, one in promised if cost < least][: limits.promising]


def select_promising(
    fits: Mapping[Key, Sequence[Hypothesis]], least: float, limits: SearchThresholds
) -> dict[Key, Hypothesis]:
    """Select the sets with the largest predicted cost reduction, each from its most promising start.

    Args:
        fits: Fits of each form of each set.
        least: Predicted cost that they have to promise less than.
        limits: Thresholds of the search.
    """
    best = {key: min(ones, key=lambda one: one.predicted_cost) for key, ones in fits.items()}
    promising = [key for key, one in best.items() if one.predicted_cost < least]
    return {
        key: best[key]
        for key in sorted(promising, key=lambda key: best[key].predicted_cost)[: limits.promising]
    }


def _is_among(hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> bool:
    return any(hypothesis is other for other in others)


def _fit_further(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    hypothesis = improve_initial_states(problem, hypothesis)
    return _lower(hypothesis, _refit(problem, hypothesis, problem.thresholds.search.second_iterations))


def _lower(before: Hypothesis, after: Hypothesis | None) -> Hypothesis:
    return after if after is not None and after.cost <= before.cost else before


def _sort_by_cost(field: Iterable[Hypothesis]) -> list[Hypothesis]:
    return sorted(field, key=_cost)


def _cost(hypothesis: Hypothesis) -> float:
    return hypothesis.cost
