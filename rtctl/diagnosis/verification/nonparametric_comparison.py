"""Whether a nonparametric alternative, a law outside of the catalogue, explains more than the named causes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rtctl.diagnosis.problem.cancellation import CancelledError
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.nonparametric import find_better_alternative, find_memory_alternative
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.static_loops.hysteresis_refit import ID as HYSTERESIS_SHAPE
from rtctl.diagnosis.verification.holdout_gain import added_mechanisms
from rtctl.diagnosis.verification.verdict import Verdict

OUTDONE = (
    "{} would remove most of the error, but a nonparametric alternative leaves a smaller residual, so it is not named. "
    "The alternative: {} See what the error goes with"
)
NOT_COMPARED = (
    "stopped by the user before the nonparametric alternatives were compared: one of them may explain the data better "
    "than {}"
)


def compare_nonparametric(
    verdict: Verdict,
    search: SearchResult,
    problem: Problem,
    budget: WorkBudget,
    report: Callable[[str], None],
) -> Verdict:
    """Withdraw the named causes where a nonparametric alternative fits better.

    Causes that leave something are compared with all alternatives by what they leave. Causes that pass the residual
    tests are compared with forces along the past of the motion, which those tests do not see.

    Args:
        verdict: What is claimed so far.
        search: What was found.
        problem: Records that were fitted.
        budget: Work of the diagnosis, which the comparison may exceed a little.
        report: Called with what is under way.
    """
    refit = search.hysteresis_refit
    if not verdict.names_causes or (verdict.claim == "explained" and refit):
        return verdict
    names = ", ".join([*added_mechanisms(search), *([HYSTERESIS_SHAPE] if refit and refit.is_cause else [])])
    alternative = search.better_alternative
    if alternative is None:
        nominal, chosen = search.nominal.hypothesis, search.chosen
        try:
            if verdict.claim == "explained":
                alternative = find_memory_alternative(problem, nominal, chosen, budget, report)
            else:
                alternative = find_better_alternative(problem, nominal, chosen.hypothesis, budget, report)
        except CancelledError:
            return replace(verdict.with_note(NOT_COMPARED.format(names)), stopped=True)
    return verdict.changed_to("unexplained", OUTDONE.format(names, alternative)) if alternative else verdict
