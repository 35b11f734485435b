"""Refit of the static hysteresis behind a set of causes, kept where records that took no part in a fit support it.

The identification's own records show whether the static loops are too coarse, whatever else acts on the others. If they
do, the causes found so far stay, the loops are refitted behind them from the fitted records too, and are a cause if the
error on test records falls: noise, and causes that the loops could imitate, do not repeat there. Where those records
show nothing, but causes leave more than the noise, the loops are refitted behind them as a mere correction: what lies
between the levels of a staircase was never measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import RefittedParts
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without, refit_without_each
from rtctl.diagnosis.search.holdout_error import compute_free_run_error, measure_gains
from rtctl.diagnosis.search.model_selection import best_of_each_set, rank_hypotheses
from rtctl.diagnosis.search.outcome import HysteresisRefit, SearchResult
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.successive_halving import halve_successively
from rtctl.identification.fit_record import FitRecord

ID = "hysteresis.shape"


def _report_nothing(text: str) -> None:
    pass


def share_in_staircases(search: SearchResult, problem: Problem) -> float:
    """Return the share of the removable squared error that refitted loops remove and that the staircases show of them.

    Refitted loops also take up what other causes leave: only what the staircases show is known to be theirs. 0 where
    the loops were not refitted, or where the staircases show nothing.
    """
    refit = search.hysteresis_refit
    removable = search.nominal.hypothesis.cost - noise_cost_of(search.chosen)
    if refit is None or not removable > 0.0:
        return 0.0
    readings, shown = problem.subject.coarse_part_readings, 0.0
    for output, one in refit.coarse.items():
        size = problem.size(readings[output])
        shown += 0.5 * problem.samples * (one.misfit[0] / size) ** 2 if one.is_coarse else 0.0
    removed = refit.before.cost - search.chosen.hypothesis.cost
    return float(np.clip(min(removed, shown) / removable, 0.0, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopRefitter:
    """What a refit of the static loops needs."""

    coarse: Mapping[str, Any]
    """Read-outs of the identification's records, by output."""
    problem: Problem
    """Records to fit."""
    tests: Sequence[FitRecord]
    """Records that took no part in a fit."""
    ids: Sequence[str]
    """Mechanisms of the catalogue that are tested."""
    level: float
    """Significance level of the residual tests."""
    report: Callable[[str], None] = _report_nothing
    """Called with what is under way."""
    budget: WorkBudget | None = None
    """Work of the diagnosis; None: no limit."""

    def refit_behind(self, result: SearchResult) -> SearchResult:
        """Refit the loops behind the causes of `result`; return it as it is where test records do not support that.

        A cause that is small beside the others may be the error of the loops: it is left out first.
        """
        nominal = result.nominal.hypothesis
        known = _drop_smooth_correction(self.problem, nominal, result.chosen.hypothesis)
        fewer = _drop_small_causes(self.problem, nominal, known)
        if fewer is not known and self._has_left(self.problem.thresholds.budget.refit_twice):
            without_small = self._refit_and_test(result, fewer)
            if without_small is not result and without_small.passes:
                return without_small
        return self._beside_rivals(result, known)

    def _beside_rivals(self, result: SearchResult, known: Hypothesis) -> SearchResult:
        """Refit the loops behind a set, and behind the others that leave about as much; the best one is chosen.

        What the loops are off by is most of what such a set leaves, so no criterion that counts noise alone ranks it
        among those. Behind loops of their own, sets stay rivals where test records do not tell them apart.
        """
        best = self._refit_and_test(result, known)
        if best is result:
            return result
        limits, tried = self.problem.thresholds.search, [best]
        for one in _list_rivals(result, known, limits.similar_cost)[: limits.refits_beside]:
            if not self._has_left(self.problem.thresholds.budget.refit_twice):
                break
            behind = self._refit_and_test(result, one)
            if behind is not result and len(behind.chosen.hypothesis.mechanisms) == len(
                best.chosen.hypothesis.mechanisms
            ):
                tried.append(behind)
        best = min(tried, key=lambda one: one.chosen.hypothesis.cost)
        alike = [one.chosen for one in tried if one is not best and self._is_rival(best.chosen, one.chosen)]
        return best._replace(equivalent=tuple(one.hypothesis for one in alike))

    def _is_rival(self, best: TestedHypothesis, other: TestedHypothesis) -> bool:
        """Return whether test records do not tell `other` from `best`: no error is certainly larger."""
        gains = measure_gains(best.hypothesis, other, self.problem, self.tests)
        return bool(gains) and all(one.ratio_high >= 1.0 for one in gains)

    def refit_nominal(self, result: SearchResult) -> SearchResult | None:
        """Refit the loops behind the nominal model alone; None where that does not help on the test records."""
        nominal = result.nominal.hypothesis
        refitted = self._refit_loops(nominal)
        if refitted is None:
            return None
        tested = run_residual_tests(refitted.fit, self.problem, self.ids)
        if not self._helps(nominal, tested, 1.0):
            return None
        refit = HysteresisRefit(self.coarse, refitted.placed.loops, nominal)
        return result._replace(
            chosen=tested, passes=tested.p_value > self.level, equivalent=(), hysteresis_refit=refit
        )

    def refit_behind_best(self, alone: SearchResult, rivals: Sequence[Hypothesis]) -> SearchResult:
        """Refit the loops behind each of `rivals`; return the best of these, `alone` where test records support none.

        Args:
            alone: Loops refitted behind fewer causes.
            rivals: Sets of causes.
        """
        best = alone
        for one in rivals:
            if not self._has_left(self.problem.thresholds.budget.refit_twice):
                break
            tried = self._refit_and_test(alone, one)
            if tried.chosen.hypothesis.cost < best.chosen.hypothesis.cost:
                best = tried
        return best

    def add_causes(self, result: SearchResult) -> SearchResult:
        """Add causes behind loops that were refitted, as long as something is left and test records support it.

        Beside the error of the identified loops a second cause takes too little to be followed; behind refitted loops
        it is what is left.
        """
        limits = self.problem.thresholds.search
        while not result.passes and self._has_left(self.problem.thresholds.budget.refit_twice):
            candidates = propose_candidates(result.chosen, limits)
            fits = halve_successively(self.problem, candidates, self.report, self.budget)
            before = result.chosen.hypothesis
            near = limits.similar_cost * min((one.cost for one in fits), default=0.0)
            helping = [
                one
                for one in fits[: limits.refits_beside]
                if one.cost < near
                and self._helps(before, result.chosen._replace(hypothesis=one), limits.least_holdout_gain)
            ]
            larger = self.refit_behind_best(result, helping)
            if larger is result:
                break
            exchanged = len(larger.chosen.hypothesis.mechanisms) <= len(before.mechanisms)
            if exchanged and not larger.passes:
                break
            result = self._ranked(result, larger, fits)
            if exchanged:
                break
        return result

    def _ranked(self, result: SearchResult, larger: SearchResult, fits: Sequence[Hypothesis]) -> SearchResult:
        """Return `larger` ranked among the sets of its size that were fitted, with the first loops as those before."""
        chosen, refit = larger.chosen.hypothesis, larger.hysteresis_refit
        size = len(chosen.mechanisms) - len(result.nominal.hypothesis.mechanisms)
        others = [one for one in fits if len(one.mechanisms) == len(chosen.mechanisms)]
        ranking = rank_hypotheses(
            self.problem, best_of_each_set([chosen, *others]), larger.chosen, plain=not larger.passes
        )
        if refit is not None and result.hysteresis_refit is not None:
            refit = refit._replace(before=result.hysteresis_refit.before)
        return larger._replace(rankings=(*result.rankings[: size - 1], ranking), hysteresis_refit=refit)

    def _refit_and_test(self, result: SearchResult, known: Hypothesis) -> SearchResult:
        """Refit the loops behind `known`, drop the causes that they replace, and test what that gains."""
        problem, nominal = self.problem, result.nominal.hypothesis
        refitted = self._refit_loops(known)
        if refitted is None:
            return result
        bare = fit_hypothesis(
            problem,
            refitted.placed(nominal.simulation),
            nominal.mechanisms,
            nominal.starts,
            fixed_parameters=nominal.fixed_parameters,
        )
        if bare is None:
            return result
        remaining = _drop_replaced_causes(problem, bare, refitted.fit)
        refit = HysteresisRefit(self.coarse, refitted.placed.loops, known)
        if not refit.is_cause and remaining.mechanisms == bare.mechanisms:
            return result
        tested = run_residual_tests(remaining, problem, self.ids)
        if not self._is_supported(result, tested, bare, refit):
            return result
        return result._replace(
            chosen=tested, passes=tested.p_value > self.level, equivalent=(),
            leave_one_out=refit_without_each(problem, bare, remaining), hysteresis_refit=refit,
        )  # fmt: skip

    def _is_supported(
        self, result: SearchResult, tested: TestedHypothesis, bare: Hypothesis, refit: HysteresisRefit
    ) -> bool:
        """Return whether test records support the refit.

        Where nothing more is claimed by it, since the set passes as it is, any certain gain is enough. Behind a mere
        correction the causes have to help by themselves.
        """
        least = self.problem.thresholds.search.least_holdout_gain
        claimed = refit.is_cause or not result.passes
        if not self._helps(result.chosen.hypothesis, tested, least if claimed else 1.0):
            return False
        return refit.is_cause or self._helps(bare, tested, least)

    def _helps(self, before: Hypothesis, after: TestedHypothesis, least: float) -> bool:
        """Return whether an output's error on test records falls to one over `least` beyond the noise, none rising."""
        gains = measure_gains(before, after, self.problem, self.tests)
        lower = any(one.ratio_low > 1.0 and one.falls_to(least) for one in gains)
        return lower and all(one.ratio > self.problem.thresholds.search.rising_error for one in gains)

    def _has_left(self, steps: float) -> bool:
        return self.budget is None or self.budget.left > steps

    def _refit_loops(self, known: Hypothesis) -> _RefittedLoops | None:
        """Refit the loops behind `known`; return None where they leave no less.

        They are refitted twice if the budget allows: with the first loops the causes are nearer to the truth.
        """
        starts = [one for one in (_fit_as_identified(self.problem, known), known) if one is not None]
        first = min(
            (self._refit_once(one, known.fixed_parameters) for one in starts), key=lambda one: one.fit.cost
        )
        if not first.fit.cost < known.cost:
            return None
        if not self._has_left(0.0):
            return first
        second = self._refit_once(first.fit, known.fixed_parameters)
        return second if second.fit.cost < first.fit.cost else first

    def _refit_once(self, behind: Hypothesis, fixed_parameters: frozenset[str]) -> _RefittedLoops:
        """Refit the loops behind a hypothesis and fit that with them; it stays as it was where that diverges."""
        problem = self.problem
        assert problem.subject.refit_parts is not None
        placed = problem.subject.refit_parts(self.coarse, behind, problem, self.report)
        fit = fit_hypothesis(
            problem,
            placed(behind.simulation),
            behind.mechanisms,
            behind.starts,
            fixed_parameters=fixed_parameters,
        )
        return _RefittedLoops(placed, fit or behind)


def _list_rivals(result: SearchResult, known: Hypothesis, similar: float) -> list[Hypothesis]:
    """Return the other sets of as many causes that cost about as much as `known`, the cheapest first."""
    size = len(known.mechanisms) - len(result.nominal.hypothesis.mechanisms)
    if not 0 < size <= len(result.rankings):
        return []
    others = [one.hypothesis for one in result.rankings[size - 1]]
    return sorted(
        (
            one
            for one in others
            if set(one.mechanisms) != set(known.mechanisms)
            and ID not in one.mechanisms
            and one.cost < similar * known.cost
        ),
        key=lambda one: one.cost,
    )


class _RefittedLoops(NamedTuple):
    """Refitted loops, and the hypothesis fitted with them."""

    placed: RefittedParts
    fit: Hypothesis


def _fit_as_identified(problem: Problem, known: Hypothesis) -> Hypothesis | None:
    """Fit `known` with the gains and offsets of the identification; return None where the records need others.

    Free gains compensate for the error of the loops, and then the causes are off behind which these are refitted.
    """
    identified = problem.subject.session_corrections
    values = np.array([identified.get(one.name, one.value) for one in known.simulation.parameters])
    simulation, fixed_parameters = (
        known.simulation.with_values(values),
        known.fixed_parameters | frozenset(identified),
    )
    fit = fit_hypothesis(
        problem, simulation, known.mechanisms, known.starts, fixed_parameters=fixed_parameters
    )
    most = problem.thresholds.search.as_identified_cost * known.cost
    return fit if fit is not None and fit.cost < most else None


def _drop_smooth_correction(problem: Problem, nominal: Hypothesis, chosen: Hypothesis) -> Hypothesis:
    """Drop the smooth correction of the loops, which refitted ones replace."""
    rest = tuple(name for name in chosen.mechanisms if name != ID)
    if rest == chosen.mechanisms or ID in nominal.mechanisms:
        return chosen
    if rest == nominal.mechanisms:
        return nominal
    return refit_without(problem, nominal, chosen, rest) or chosen


def _drop_small_causes(problem: Problem, nominal: Hypothesis, known: Hypothesis) -> Hypothesis:
    """Drop the causes that remove little of what the set does, but not the last one."""
    most = problem.thresholds.search.small_removed_share * (nominal.cost - known.cost)
    fewer = known
    while len(fewer.mechanisms) > len(nominal.mechanisms) + 1:
        reduced = min(refit_without_each(problem, nominal, fewer), key=lambda one: one.cost, default=None)
        if reduced is None or reduced.cost - known.cost > most:
            break
        fewer = reduced
    return fewer


def _drop_replaced_causes(problem: Problem, bare: Hypothesis, fit: Hypothesis) -> Hypothesis:
    """Drop the causes that hardly matter once the loops are refitted."""
    while len(fit.mechanisms) > len(bare.mechanisms):
        reduced = min(refit_without_each(problem, bare, fit), key=lambda one: one.cost, default=None)
        if reduced is None or reduced.cost > problem.thresholds.search.negligible_cost * fit.cost:
            break
        fit = reduced
    return fit


def compute_error_over_noise(tested: TestedHypothesis, tests: Sequence[FitRecord]) -> float:
    """Return the ratio of error on test records (RMS) to unpredictable noise, of the output where it is largest.

    The slow part of a residual may be noise or the model's own error, and a noise model takes it for noise; so only the
    innovations' variance counts. Returns 0 where no test record has an output.
    """
    simulation, most = tested.hypothesis.simulation, 0.0
    for name, noise in zip(tested.hypothesis.sensitivity.outputs, tested.noise, strict=True):
        errors = [
            compute_free_run_error(simulation, record, name) for record in tests if name in record.measured
        ]
        if errors and noise.variance > 0.0:
            most = max(most, float(np.sqrt(np.mean(np.concatenate(errors) ** 2) / noise.variance)))
    return most
