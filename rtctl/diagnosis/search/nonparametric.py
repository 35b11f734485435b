"""Whether a law of no name explains more than causes do: then none of them is the cause."""

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
from rtctl.diagnosis.search.candidates import propose_candidates
from rtctl.diagnosis.search.model_selection import whitened_bic
from rtctl.diagnosis.search.successive_halving import FIRST_LAP, halve_successively

ENOUGH = 24_000
"""Samples."""
BETTER = 0.8
"""Of the cost: a law of no name that leaves less than this share of what the named causes leave. Of an oscillator also
of the cost beyond the noise's own: near the noise no law leaves a fifth less."""
LIKELIER = 10.0
"""Difference of BIC by which a law of no name has to be the likelier one, near the noise."""
SUSPECT = 1e-3
"""P-value of forces along the past of the motion: below it a set that passes is compared with laws of such forces."""


def find_better_alternative(
    problem: Problem, nominal: Hypothesis, named: Hypothesis, budget: WorkBudget,
    report: Callable[[str], None] = lambda text: None,
) -> str:  # fmt: skip
    """The sentence of the subject's law of no name that, alone, leaves least, if clearly less than `named`; else "".

    Both by a first look at the records. `budget`: of the diagnosis, which this may outlast a little. `report` hears
    each fit.
    """
    few = _few(problem)
    glance = few.glance
    first, other = (replace(one, starts=one.starts[: len(few.records)]) for one in (nominal, named))
    seen = fit_hypothesis(
        glance, other.simulation, other.mechanisms, other.starts, FIRST_LAP, still=other.still
    )
    if seen is None:
        return ""
    law = _ahead(few, first, problem.subject.unnamed, budget, report)
    if law is None or law.cost >= seen.cost:
        return ""
    if law.cost < BETTER * seen.cost:
        return _sentence(law)
    return "" if problem.allowed else _beyond_noise(problem, nominal, law, named)


def _beyond_noise(problem: Problem, nominal: Hypothesis, law: Hypothesis, named: Hypothesis) -> str:
    """The sentence of `law` if it leaves clearly less than `named` beyond what the noise leaves of both."""
    whole = _on_all(problem, nominal, law)
    if whole is None:
        return ""
    left = run_residual_tests(whole, problem, ())
    noise = noise_cost_of(left)
    clearly = whole.cost - noise < BETTER * (named.cost - noise)
    return _sentence(law) if clearly and _likelier(whole, named, problem, left) else ""


def find_memory_alternative(
    problem: Problem, nominal: Hypothesis, named: TestedHypothesis, budget: WorkBudget,
    report: Callable[[str], None] = lambda text: None,
) -> str:  # fmt: skip
    """The same behind causes that pass the gate, which does not ask for forces along the past of the motion: of a law
    of such forces that is likelier. It is looked for only where the residual has room for one.
    """
    past = problem.subject.past
    if past is None or not compute_memory_p_value(named, problem) < SUSPECT:
        return ""
    few = _few(problem)
    first = replace(nominal, starts=nominal.starts[: len(few.records)])
    law = _ahead(few, first, past.laws, budget, report)
    whole = _on_all(problem, nominal, law) if law is not None else None
    return (
        _sentence(whole) if whole is not None and _likelier(whole, named.hypothesis, problem, named) else ""
    )


def _ahead(
    problem: Problem,
    nominal: Hypothesis,
    laws: Sequence[str],
    budget: WorkBudget,
    report: Callable[[str], None],
) -> Hypothesis | None:
    """The law that leaves least."""
    runners = propose_candidates(run_residual_tests(nominal, problem, laws))
    runners.sort(key=lambda runner: laws.index(runner.mechanisms[-1]))
    field = halve_successively(
        problem.glance, runners, report, budget.further(budget.thresholds.nonparametric)
    )
    return field[0] if field else None


def _on_all(problem: Problem, nominal: Hypothesis, law: Hypothesis) -> Hypothesis | None:
    """`law`, fitted to the first records, on all of them."""
    if len(law.starts) == len(problem.records):
        return law
    starts = np.concatenate((law.starts, nominal.starts[len(law.starts) :]))
    return fit_hypothesis(problem, law.simulation, law.mechanisms, starts, FIRST_LAP, still=law.still)


def _few(problem: Problem) -> Problem:
    """The first records, as many as tell one law from another: some laws take long to simulate."""
    count, samples = 0, 0
    while count < len(problem.records) and (count == 0 or samples + problem.records[count].samples <= ENOUGH):
        samples += problem.records[count].samples
        count += 1
    return replace(problem, records=problem.records[:count])


def compute_memory_p_value(named: TestedHypothesis, problem: Problem) -> float:
    """P-value of forces along the past of the motion in what `named` leaves; 1 of a subject that has none."""
    past = problem.subject.past
    if past is None:
        return 1.0
    asked = replace(problem, subject=replace(problem.subject, forces=past.forces, slopes=past.slopes))
    tests = run_residual_tests(named.hypothesis, asked, (), named.noise).tests
    return min(test.p_value for test in tests if test.name == "generic forces")


def _likelier(law: Hypothesis, named: Hypothesis, problem: Problem, noise_of: TestedHypothesis) -> bool:
    """In the noise that `noise_of` leaves."""
    first, other = (whitened_bic(problem, one, noise_of.noise) for one in (law, named))
    return first < other - LIKELIER


def _sentence(law: Hypothesis) -> str:
    return state_simulated(law.simulation, law.mechanisms[-1])
