"""Where initial parts of records are explained: the model that explains them follows the records further.

Records are cut where the nominal model takes another course. A delay does that early, and a stop that the motion
reaches later is then in no part. With the delay the model follows up to the stop and beyond: the search goes on there,
from the model with the causes that were found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import drop_unneeded_causes
from rtctl.diagnosis.search.model_selection import RankedHypothesis, rank_hypotheses, whitened_bic
from rtctl.diagnosis.search.outcome import SearchResult, find_equivalents
from rtctl.diagnosis.search.request import FoundCauses, SearchRequest
from rtctl.diagnosis.search.stepwise import significance_level

FURTHER = (
    "with {} the model follows {} samples of the records instead of {}: the search went on there, from the model with "
    "that"
)
UNNEEDED = "{} was needed in the shorter parts alone, and is left out"


class Searched(NamedTuple):
    """A search in parts of the records: the fit that chose the parts, what was asked, what was found."""

    first: NominalFit
    """The re-fitted nominal model, and the parts."""
    request: SearchRequest
    found: FoundCauses
    cut: tuple[str, ...] = ()
    """What is said of test records that are judged in part."""


def search_longer_parts(
    searched: Searched,
    fit: Callable[[Simulation], NominalFit | None],
    search: Callable[[NominalFit], Searched],
) -> Searched:
    """Return what a search in longer parts finds beside causes that explain shorter ones; else what was found.

    Args:
        searched: Search in initial parts.
        fit: Fits a model and chooses the parts that it follows; None where it cannot be fitted.
        search: Searches the catalogue in the parts of such a fit.
    """
    limits = searched.request.problem.thresholds.search
    while _explains_parts(searched) and not searched.request.budget.cut_by_clock:
        first = fit(searched.found.result.chosen.hypothesis.simulation)
        if searched.request.problem.cancellation.cancelled:
            return searched._replace(found=searched.found._replace(cancelled=True))
        if first is None or first.problem.samples <= limits.longer_parts * searched.first.problem.samples:
            break
        longer = search(first)
        if longer.found.cancelled:
            return searched._replace(found=searched.found._replace(cancelled=True))
        joined = _joined(searched, longer)
        if joined is None:
            break
        searched = joined
    return searched


def _explains_parts(searched: Searched) -> bool:
    """Return whether initial parts alone were searched, and causes explain them."""
    result, first = searched.found.result, searched.first
    is_nominal = result.chosen.hypothesis.mechanisms == result.nominal.hypothesis.mechanisms
    is_part = first.uncut or first.in_strokes or result.hysteresis_refit is not None
    return result.passes and not (is_nominal or is_part or searched.found.cancelled)


def _joined(before: Searched, longer: Searched) -> Searched | None:
    """Return the search in longer parts as one of the nominal model, with the causes of both; None without support.

    Where longer parts need no more causes, they determine the same ones better.
    """
    first, outcome = before.found.result, longer.found.result
    ids = before.request.ids
    if not outcome.passes:
        return None
    problem, nominal = outcome.refined_problem or longer.request.problem, first.nominal.hypothesis
    outcome = _as_simple_as_before(first, outcome, problem, ids)
    fixed = nominal.fixed_parameters
    refitted = fit_hypothesis(problem, nominal.simulation, nominal.mechanisms, fixed_parameters=fixed)
    if refitted is None:
        return None
    causes = first.chosen.hypothesis.mechanisms[len(nominal.mechanisms) :]
    level = significance_level(problem, before.request.options.false_claim_rate)
    chosen, reduced = drop_unneeded_causes(problem, refitted, outcome.chosen, ids, level)
    outcome = outcome._replace(chosen=chosen)
    unneeded = [name for name in causes if name not in chosen.hypothesis.mechanisms]
    result = outcome._replace(
        nominal=run_residual_tests(refitted, problem, ids),
        rankings=_comparable(first, outcome),
        leave_one_out=reduced,
        equivalent=(*outcome.equivalent, *_refit_rivals(first, outcome, problem, unneeded)),
    )
    samples = longer.first.problem.samples, before.first.problem.samples
    notes = [*before.found.notes, FURTHER.format(", ".join(causes), *samples), *longer.found.notes]
    notes += [UNNEEDED.format(", ".join(unneeded))] if unneeded else []
    return Searched(
        as_initial_parts(longer.first, before.first),
        longer.request._replace(nominal=refitted),
        longer.found._replace(result=result, notes=notes),
        longer.cut,
    )


def _as_simple_as_before(
    first: SearchResult, outcome: SearchResult, problem: Problem, ids: Sequence[str]
) -> SearchResult:
    """Return the same causes with what shorter parts did not need left out, unless longer ones need it.

    A model that is followed further is fitted with all of its parameters: a stop has a damper again, of nanoseconds.
    """
    known, chosen = first.chosen.hypothesis, outcome.chosen.hypothesis
    if known.mechanisms != chosen.mechanisms or known.fixed_parameters <= chosen.fixed_parameters:
        return outcome
    simpler = fit_hypothesis(
        problem, known.simulation, known.mechanisms, chosen.starts, fixed_parameters=known.fixed_parameters
    )
    if simpler is None:
        return outcome
    noise = outcome.chosen.noise
    worse = whitened_bic(problem, simpler, noise) - whitened_bic(problem, chosen, noise)
    if worse > problem.thresholds.search.needed_bic:
        return outcome
    return outcome._replace(
        chosen=run_residual_tests(simpler, problem, ids)._replace(tests=outcome.chosen.tests)
    )


def as_initial_parts(longer: NominalFit, first: NominalFit) -> NominalFit:
    """Return longer parts as parts of the whole records of the `first` fit, which they need not follow to their end.

    A fit of the causes to whole records, beyond where their motion is predictable, says nothing of the causes.
    """
    return longer._replace(whole=first.whole, parted=longer.parted or first.parted)


def _refit_rivals(
    first: SearchResult, outcome: SearchResult, problem: Problem, unneeded: Sequence[str]
) -> tuple[Hypothesis, ...]:
    """Return the sets that shorter parts did not tell from the chosen one and longer ones do not either.

    What longer parts need beside the first set is added to its rivals; what of it they do not need is left out.
    """
    chosen, nominal = outcome.chosen.hypothesis, first.nominal.hypothesis
    added = tuple(name for name in chosen.mechanisms if name not in first.chosen.hypothesis.mechanisms)
    values = {one.name: one.value for one in chosen.simulation.parameters if one.mechanism in added}
    fits = []
    for rival in first.equivalent:
        kept = (*(name for name in rival.mechanisms if name not in unneeded), *added)
        if len(kept) != len(chosen.mechanisms) or set(kept) == set(chosen.mechanisms):
            continue
        known = {one.name: one.value for one in rival.simulation.parameters} | values
        simulation = nominal.simulation.extended(kept[len(nominal.mechanisms) :])
        start = np.array([known[one.name] for one in simulation.parameters])
        fixed = rival.fixed_parameters | {name for name in chosen.fixed_parameters if name in values}
        fixed &= {one.name for one in simulation.parameters}
        fit = fit_hypothesis(problem, simulation.with_values(start), kept, fixed_parameters=fixed)
        fits += [fit] if fit is not None else []
    if not fits:
        return ()
    ranking = rank_hypotheses(problem, [chosen, *fits], outcome.chosen, plain=not outcome.passes)
    return find_equivalents(problem, [ranking], outcome.chosen, plain=not outcome.passes)


def _comparable(first: SearchResult, outcome: SearchResult) -> tuple[tuple[RankedHypothesis, ...], ...]:
    """Return the sets whose costs are of the same parts: those of the longer ones, or the rivals of a set that stays.

    A cause costs less in shorter parts: beside a set that was fitted to longer ones it would seem to explain it all.
    """
    if outcome.rankings:
        return outcome.rankings
    size = len(outcome.chosen.hypothesis.mechanisms)
    return tuple(one for one in first.rankings if one and len(one[0].hypothesis.mechanisms) == size)
