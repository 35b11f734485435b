"""How long a search takes on this machine, told before it begins: from the time of one evaluation of the nominal model.

One evaluation (residuals of all records, their derivatives, one linear solution) is what every iteration of every fit
consists of; how many a search needs depends on what it finds, and hardly on the size of the data.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import NamedTuple

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.output.fit_lines import Lasting
from rtctl.output.live_line import clock_text

TEXT = "about {} if one cause explains it, {} if it takes two{}; less if nothing is wrong"


class ExpectedTime(NamedTuple):
    """Wall time from now on [s], by what the search finds."""

    one_s: float
    """One cause explains the data."""
    two_s: float
    """Two causes do."""
    most_s: float
    """The work budget is used up; infinite: there is none."""

    @property
    def text(self) -> Lasting:
        """Return what a user is told; it stays on the screen."""
        most = f", {clock_text(self.most_s)} if it uses up its work budget" if self.most_s < inf else ""
        return Lasting(TEXT.format(clock_text(self.one_s), clock_text(self.two_s), most))


def tell_time(
    problem: Problem, nominal: Hypothesis, budget: WorkBudget, report: Callable[[str], None]
) -> WorkBudget:
    """Tell how long a search takes, and return its budget without the work of finding that out.

    An answer does not depend on what is told. Where nothing may be searched, nothing is told.

    Args:
        problem: Records to fit.
        nominal: Nominal model, fitted to them.
        budget: Work that the search may do.
        report: Called with the text.
    """
    if budget.spent:
        return budget
    before = budget.counted()
    report(expect_time(problem, nominal, budget).text)
    return replace(budget, started_at=budget.started_at + budget.counted() - before)


def expect_time(problem: Problem, nominal: Hypothesis, budget: WorkBudget) -> ExpectedTime:
    """Time evaluations of the fitted nominal model, and multiply.

    The shortest of a few counts: the first one may compile, and other programs interrupt.
    """
    limits, before, left, least_s = budget.thresholds, budget.counted(), budget.left, inf
    for _ in range(limits.timed_evaluations):
        begun = time.perf_counter()
        fit_hypothesis(
            problem, nominal.simulation, nominal.mechanisms, nominal.starts, 0, nominal.fixed_parameters
        )
        least_s = min(least_s, time.perf_counter() - begun)
    steps = (budget.counted() - before) / limits.timed_evaluations
    most_s = inf
    if steps > 0.0:
        simulated, other = limits.simulated_share, 1.0 - limits.simulated_share
        most_s = (left + limits.overrun) * (simulated * least_s / steps + other * limits.other_step_s)
    one_s, two_s = (
        min(least_s * count, most_s) for count in (limits.evaluations_of_one, limits.evaluations_of_two)
    )
    return ExpectedTime(one_s, two_s, most_s)
