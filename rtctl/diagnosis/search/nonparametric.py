"""Nonparametric alternatives: if one explains more than the named causes do, none of these is the cause.

The alternatives of a subject are laws in no catalogue: a spring of any shape, a damping of any power, a force along the
past motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.statement import state_simulated
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.model_selection import whitened_bic
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.successive_halving import halve_successively


def find_better_alternative(
    problem: Problem, nominal: Hypothesis, named: Hypothesis, budget: WorkBudget,
    report: Callable[[str], None] = lambda text: None, laws: Sequence[str] = (),
) -> str:  # fmt: skip
    """Return the sentence of the best nonparametric alternative if it explains clearly more than the causes; else "".

    Both are compared on the first samples, and near the noise on all samples.

    Args:
        problem: Records that were fitted.
        nominal: Fitted nominal model, or a set that the alternatives are added to.
        named: Fitted set of causes that leaves more than the noise.
        budget: Work of the diagnosis, which this may exceed by a bounded amount.
        report: Called with a text before each fit.
        laws: Ids of the alternatives; (): all of the subject.

    Raises:
        CancelledError: Between two fits, once the problem's cancellation token is set.
    """
    limits, few = problem.thresholds.search, _take_first_samples(problem)
    first, other = (replace(one, starts=one.starts[: len(few.records)]) for one in (nominal, named))
    causes = fit_hypothesis(
        few.glance,
        other.simulation,
        other.mechanisms,
        other.starts,
        limits.first_iterations,
        fixed_parameters=other.fixed_parameters,
    )
    if causes is None:
        return ""
    asked = laws or problem.subject.nonparametric_alternatives
    law = _fit_best_alternative(few, first, asked, budget, report)
    if law is None or law.cost >= causes.cost:
        return ""
    if law.cost < limits.alternative_cost * causes.cost:
        return _state(law)
    return "" if problem.allowed else _state_if_beyond_noise(problem, nominal, law, named)


def _state_if_beyond_noise(problem: Problem, nominal: Hypothesis, law: Hypothesis, named: Hypothesis) -> str:
    """Return the sentence of `law` if it leaves clearly less than `named` beyond the noise, and is likelier."""
    whole = _fit_all_records(problem, nominal, law)
    if whole is None:
        return ""
    tested = run_residual_tests(whole, problem, ())
    noise = noise_cost_of(tested)
    clearly = whole.cost - noise < problem.thresholds.search.alternative_cost * (named.cost - noise)
    return _state(law) if clearly and _is_likelier(whole, named, problem, tested) else ""


def find_memory_alternative(
    problem: Problem, nominal: Hypothesis, named: TestedHypothesis, budget: WorkBudget,
    report: Callable[[str], None] = lambda text: None,
) -> str:  # fmt: skip
    """Return the sentence of a law with memory that is likelier than causes that pass the residual tests; else "".

    The residual tests do not test forces along the past motion. Such a law is fitted only where the residual has room
    for one.

    Args:
        problem: Records that were fitted.
        nominal: Fitted nominal model.
        named: Set of causes that passes.
        budget: Work of the diagnosis, which this may exceed by a bounded amount.
        report: Called with a text before each fit.

    Raises:
        CancelledError: Between two fits, once the problem's cancellation token is set.
    """
    past = problem.subject.memory_forces
    if past is None or not compute_memory_p_value(named, problem) < problem.thresholds.search.memory_p:
        return ""
    few = _take_first_samples(problem)
    first = replace(nominal, starts=nominal.starts[: len(few.records)])
    law = _fit_best_alternative(few, first, past.laws, budget, report)
    whole = _fit_all_records(problem, nominal, law) if law is not None else None
    likelier = whole is not None and _is_likelier(whole, named.hypothesis, problem, named)
    return _state(whole) if whole is not None and likelier else ""


def _fit_best_alternative(
    problem: Problem,
    nominal: Hypothesis,
    laws: Sequence[str],
    budget: WorkBudget,
    report: Callable[[str], None],
) -> Hypothesis | None:
    """Return the law of the lowest cost; those that take least time are fitted first."""
    first = problem.initial_part(problem.thresholds.residual.first_samples)
    candidates = propose_candidates(run_residual_tests(nominal, first, laws), problem.thresholds.search)
    candidates.sort(key=lambda candidate: laws.index(candidate.mechanisms[-1]))
    budget = budget.further(budget.thresholds.nonparametric)
    fits = halve_successively(problem.glance, candidates, report, budget)
    return fits[0] if fits else None


def _fit_all_records(problem: Problem, nominal: Hypothesis, law: Hypothesis) -> Hypothesis | None:
    """Fit `law`, fitted to the first samples, to all of them."""
    if _take_first_samples(problem).samples == problem.samples:
        return law
    starts = np.concatenate((law.starts, nominal.starts[len(law.starts) :]))
    iterations = problem.thresholds.search.first_iterations
    return fit_hypothesis(
        problem, law.simulation, law.mechanisms, starts, iterations, fixed_parameters=law.fixed_parameters
    )


def _take_first_samples(problem: Problem) -> Problem:
    """Take as many of the first samples as tell one law from another: some laws take long to simulate."""
    most, count, samples = problem.thresholds.search.alternative_samples, 0, 0
    while count < len(problem.records) and (count == 0 or samples + problem.records[count].samples <= most):
        samples += problem.records[count].samples
        count += 1
    return replace(problem, records=problem.records[:count]).initial_part(most)


def compute_memory_p_value(named: TestedHypothesis, problem: Problem) -> float:
    """Return the p-value of forces along the past motion in the residual; 1 where none can be tested."""
    past = problem.subject.memory_forces
    if past is None:
        return 1.0
    with_past = replace(
        problem,
        subject=replace(problem.subject, forces=past.forces, force_sensitivities=past.force_sensitivities),
    )
    tests = run_residual_tests(named.hypothesis, with_past, (), named.noise).tests
    return min((test.p_value for test in tests if test.name == "generic forces"), default=1.0)


def _is_likelier(law: Hypothesis, named: Hypothesis, problem: Problem, noise_of: TestedHypothesis) -> bool:
    """Return whether `law` is likelier than `named` in the noise that `noise_of` leaves."""
    first, other = (whitened_bic(problem, one, noise_of.noise) for one in (law, named))
    return first < other - problem.thresholds.search.alternative_bic


def _state(law: Hypothesis) -> str:
    return state_simulated(law.simulation, law.mechanisms[-1])
