"""Simpler laws: a law that another one is at certain values of its parameters is told unless the data need the other.

Dry friction is Stribeck's without an excess, Dahl's with a stiff contact, and a smooth one of no width. Each of those
fits whatever it fits, a little better. So the more general law has to be worth its further parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.basin_search import search_basins
from rtctl.diagnosis.problem.bounds import clip_to_bounds
from rtctl.diagnosis.problem.fit import defaulted, fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import takes_far_longer
from rtctl.diagnosis.search.model_selection import count_unknowns, whitened_bic
from rtctl.diagnosis.search.outcome import SearchResult, find_equivalents, replace_chosen
from rtctl.diagnosis.search.state import SearchSettings


class _Simplification(NamedTuple):
    mechanisms: tuple[str, ...]
    simulation: Simulation
    """Model with the simpler law, at the values of the more general one."""
    fixed_parameters: frozenset[str]
    is_same: bool
    """Whether the more general law, at its fitted values, is the simpler one already: an amplitude is zero."""


def prefer_simpler_laws(problem: Problem, result: SearchResult, settings: SearchSettings) -> SearchResult:
    """Choose the simpler law in place of each that the data do not need, and rank none beside a case of it.

    Args:
        problem: Records to fit.
        result: Search with its set chosen.
        settings: Mechanisms that are searched.
    """
    # A law that turns ever more narrowly takes ever more steps: all refits together end.
    refitted = problem.until(settings.budget.further(problem.thresholds.budget.followed))
    while (simpler := _find_sufficient(refitted, result, settings.ids)) is not None:
        tested = run_residual_tests(simpler, problem, settings.ids)
        if result.passes:
            tested = tested._replace(tests=result.chosen.tests)
        result = replace_chosen(problem, result, tested)
    return _without_general_rivals(result)


def prefer_fewest_unknowns(problem: Problem, result: SearchResult, settings: SearchSettings) -> SearchResult:
    """Choose, of the sets that the data do not tell from the chosen one, the one of the fewest unknowns that passes.

    Which one stands first changes no probability, but it is the one that the extended model gets: further unknowns that
    the records do not ask for are known no better than the noise lets them be, and a loop would follow them.

    Args:
        problem: Records to fit.
        result: Search whose chosen set passes.
        settings: Mechanisms that are searched, and what passes.
    """
    chosen = result.chosen.hypothesis
    same = find_equivalents(problem, result.rankings, result.chosen)
    fewest = min((chosen, *same), key=count_unknowns)
    if fewest is chosen:
        return result
    tested = run_residual_tests(fewest, problem, settings.ids)
    return replace_chosen(problem, result, tested) if settings.passes(tested) else result


def _find_sufficient(problem: Problem, result: SearchResult, ids: Sequence[str]) -> Hypothesis | None:
    """Return the chosen set with a simpler law that fits as well; None where there is none."""
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    for simplification in _simplify(nominal, chosen, ids):
        known = [one for one in result.hypotheses if _is_simplified(one, simplification)]
        refitted = _refit(problem, chosen, simplification)
        best = min((*known, *([refitted] if refitted else [])), key=lambda one: one.cost, default=None)
        if best is not None and (simplification.is_same or _suffices(problem, result, best)):
            return best
    return None


def _suffices(problem: Problem, result: SearchResult, simpler: Hypothesis) -> bool:
    """Return whether the chosen set is not worth its further parameters."""
    limits, chosen = problem.thresholds.search, result.chosen
    if not result.passes:  # the noise is not known
        return simpler.cost < limits.tied_cost * chosen.hypothesis.cost
    first, other = (whitened_bic(problem, one, chosen.noise) for one in (simpler, chosen.hypothesis))
    return first - other <= limits.needed_bic


def _is_simplified(fit: Hypothesis, simplification: _Simplification) -> bool:
    """Return whether a set is the simplified one: also with what is not fitted at the simplified values."""
    names = simplification.fixed_parameters
    if set(fit.mechanisms) != set(simplification.mechanisms) or not names <= fit.fixed_parameters:
        return False
    wanted = {one.name: one.value for one in simplification.simulation.parameters}
    return all(one.value == wanted[one.name] for one in fit.simulation.parameters if one.name in names)


def _simplify(nominal: Hypothesis, chosen: Hypothesis, ids: Sequence[str]) -> Iterator[_Simplification]:
    """Yield the chosen set with a shape at its simplest value, then with a simpler law in place of one."""
    added = [one for one in chosen.simulation.mechanisms if one.id not in nominal.mechanisms]
    names = {one.id for one in added}
    values = np.array([one.value for one in chosen.simulation.parameters])
    for k, parameter in enumerate(chosen.simulation.parameters):
        simplest = parameter.declared.simplest
        if parameter.mechanism in names and simplest is not None and parameter.value != simplest:
            simpler = values.copy()
            simpler[k] = simplest
            fixed_parameters = chosen.fixed_parameters | {parameter.name}
            yield _Simplification(
                chosen.mechanisms, chosen.simulation.with_values(simpler), fixed_parameters, is_same=False
            )
    for mechanism in added:
        for simpler_id in mechanism.generalises:
            if simpler_id in ids and simpler_id not in chosen.mechanisms:
                yield _replace_law(nominal, chosen, mechanism.id, simpler_id)


def _replace_law(nominal: Hypothesis, chosen: Hypothesis, general: str, simpler: str) -> _Simplification:
    mechanisms = tuple(simpler if name == general else name for name in chosen.mechanisms)
    added = tuple(name for name in mechanisms if name not in nominal.mechanisms)
    simulation = nominal.simulation.extended(added)
    law = next(one for one in chosen.simulation.mechanisms if one.id == general)
    of_law = {
        one.declared.name: one.value for one in chosen.simulation.parameters if one.mechanism == general
    }
    values = {one.name: one.value for one in chosen.simulation.parameters}
    values |= {f"{simpler}.{name}": value for name, value in law.generalises[simpler](of_law).items()}
    moved = np.array([values.get(one.name, one.value) for one in simulation.parameters])
    own = {one.name for one in simulation.parameters if one.mechanism == simpler}
    names = {one.name for one in simulation.parameters}
    fixed_parameters = (chosen.fixed_parameters & names) | (defaulted(simulation) & own)
    is_same = any(of_law[one.name] == one.neutral for one in law.amplitudes)
    return _Simplification(mechanisms, clip_to_bounds(simulation, moved), fixed_parameters, is_same)


def _refit(problem: Problem, chosen: Hypothesis, simplification: _Simplification) -> Hypothesis | None:
    """Fit the simpler set from where the more general one ended, across the kinks that it may have.

    None where it diverges, or a run of it takes far more steps.
    """
    if takes_far_longer(problem, simplification.simulation, chosen.simulation):
        return None
    fit = fit_hypothesis(
        problem,
        simplification.simulation,
        simplification.mechanisms,
        chosen.starts,
        problem.thresholds.search.elimination_iterations,
        simplification.fixed_parameters,
    )
    return search_basins(problem, fit) if fit is not None else None


def _without_general_rivals(result: SearchResult) -> SearchResult:
    """Leave out the rivals that are the chosen set with a more general law in place of one: they are that set."""
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    size = len(chosen.mechanisms) - len(nominal.mechanisms)
    if not 0 < size <= len(result.rankings):
        return result
    kept = tuple(one for one in result.rankings[size - 1] if not _is_more_general(one.hypothesis, chosen))
    return result._replace(rankings=(*result.rankings[: size - 1], kept, *result.rankings[size:]))


def _is_more_general(rival: Hypothesis, chosen: Hypothesis) -> bool:
    """Return whether `rival` is `chosen` with one law replaced by one of which it is a case, also of several steps."""
    theirs, ours = (
        set(rival.mechanisms) - set(chosen.mechanisms),
        set(chosen.mechanisms) - set(rival.mechanisms),
    )
    if len(theirs) != 1 or len(ours) != 1:
        return False
    (general,) = (one for one in rival.simulation.mechanisms if one.id in theirs)
    return bool(ours & general.generalises.keys())
