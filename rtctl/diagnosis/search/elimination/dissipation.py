"""Of several laws of dissipation in a set that does not pass, those that no free curve of the speed outdoes.

Two laws together imitate a third: a polynomial beside dry friction follows any curve of force over velocity. Whether
they do is seen where a free curve takes the place of the weaker one. If it leaves clearly less, the third law is none
of the catalogue: which of its laws removes most is then an answer, and their sum is none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.elimination.holdout_support import choose_smaller
from rtctl.diagnosis.search.nonparametric import find_better_alternative
from rtctl.diagnosis.search.outcome import SearchResult

DISSIPATION = {
    "damping.nonlinear", "damping.quadratic", "damping.power",
    "friction.coulomb", "friction.stribeck", "friction.presliding", "hysteresis.bouc_wen",
}  # fmt: skip
CURVE = "nonparametric.dissipation"


def drop_imitating_dissipation(
    result: SearchResult,
    problem: Problem,
    ids: Sequence[str],
    budget: WorkBudget,
    report: Callable[[str], None] = lambda text: None,
) -> tuple[SearchResult, tuple[str, ...]]:
    """Drop laws of dissipation from a set that does not pass, the weakest first, while a free curve outdoes them.

    Args:
        result: Outcome of a search.
        problem: Records that were fitted.
        ids: Mechanisms of the catalogue that are tested.
        budget: Work of the diagnosis, which the fits of a curve may exceed by a bounded amount.
        report: Called with a text before each fit.

    Returns:
        The outcome with the laws that stay, one at least, and the ids of the others.

    Raises:
        CancelledError: Between two fits, once the problem's cancellation token is set.
    """
    dropped: list[str] = []
    while not result.passes:
        chosen = result.chosen.hypothesis
        names = set(chosen.mechanisms)
        fewer = [one for one in result.leave_one_out if (names - set(one.mechanisms)) & DISSIPATION]
        if len(names & DISSIPATION) < 2 or not fewer:
            break
        kept = min(fewer, key=lambda one: one.cost)
        if not find_better_alternative(problem, kept, chosen, budget, report, (CURVE,)):
            break
        dropped += names - set(kept.mechanisms)
        result = choose_smaller(kept, result, problem, ids)
    return result, tuple(dropped)
