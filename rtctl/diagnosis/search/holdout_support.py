"""Whether the small causes of a set help on records that no fit saw: noise that is no autoregression looks like one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.backward_elimination import refit_without_each
from rtctl.diagnosis.search.holdout_error import compute_free_run_error
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.stepwise import find_equivalents, replace_chosen
from rtctl.identification.fit_record import FitRecord

SMALL = 0.02
"""Of what the set removes of the squared misfit: a cause that removes more is told, whatever test records say."""
LITTLE = 0.05
"""Of what is left: a set that removes less is small beside the noise, all of it."""
SHOWN = 0.5
"""Of a test record, where numbers of its own (a hum's) are fitted: they are judged by the rest, which has to follow."""


def drop_unsupported(
    found: SearchResult, problem: Problem, tests: Sequence[FitRecord], ids: Sequence[str], budget: WorkBudget
) -> tuple[SearchResult, tuple[str, ...]]:
    """Less the small causes without which the error on `tests` is no larger; and which those are.

    The gate's verdict stays the larger set's: what is left without them is too small to be a cause. Nothing is taken
    out once `budget` is spent, nor where no test record can be simulated.
    """
    dropped: list[str] = []
    nominal, chosen = found.nominal.hypothesis, found.chosen.hypothesis
    while tests and not budget.spent and _causes(found):
        removed = nominal.cost - chosen.cost
        little = found.passes and removed < LITTLE * chosen.cost
        alone = len(_causes(found)) == 1
        rests = (nominal,) if alone and little else () if alone else found.leave_one_out
        small = [one for one in rests if little or one.cost - chosen.cost < SMALL * removed]
        if not small:
            break
        shown = SHOWN if any(p.declared.per_record for p in chosen.simulation.parameters) else 0.0
        error = _squares(chosen, problem, tests, shown)
        rest, fewer = min(
            ((_squares(one, problem, tests, shown), one) for one in small), key=lambda pair: pair[0].sum()
        )
        seen = np.isfinite(error) & np.isfinite(rest)
        if not seen.any() or rest[seen].sum() > error[seen].sum():
            break
        dropped += set(chosen.mechanisms) - set(fewer.mechanisms)
        chosen = fewer
        found = _with(fewer, found, problem, ids)
    return found, tuple(dropped)


def _with(fewer: Hypothesis, found: SearchResult, problem: Problem, ids: Sequence[str]) -> SearchResult:
    """`found` with `fewer` chosen, by the larger set's gate."""
    if fewer is found.nominal.hypothesis:
        chosen = found.nominal._replace(tests=found.chosen.tests)
        return found._replace(chosen=chosen, equivalent=(), leave_one_out=())
    examined = run_residual_tests(fewer, problem, ids)._replace(tests=found.chosen.tests)
    found = replace_chosen(problem, found, examined)
    return found._replace(
        leave_one_out=refit_without_each(problem, found.nominal.hypothesis, fewer, found.hypotheses),
        equivalent=find_equivalents(problem, found.rankings, examined, plain=not found.passes),
    )


def _causes(found: SearchResult) -> set[str]:
    return set(found.chosen.hypothesis.mechanisms) - set(found.nominal.hypothesis.mechanisms)


def _squares(one: Hypothesis, problem: Problem, tests: Sequence[FitRecord], shown: float) -> FloatArray:
    """(records,): sums over all outputs that are there, in squares of their size, behind the share that is `shown`."""
    total = np.zeros(len(tests))
    for k, record in enumerate(tests):
        for name in one.sensitivity.outputs:
            if name in record.measured:
                error = compute_free_run_error(one.simulation, record, name, shown or 1.0)
                total[k] += float(np.sum(error[round(shown * len(error)) :] ** 2)) / problem.size(name) ** 2
    return total
