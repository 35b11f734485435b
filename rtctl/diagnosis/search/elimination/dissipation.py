"""Of several laws of dissipation in a set that does not pass, the one that removes most.

Two laws together imitate a third: a polynomial beside dry friction follows any curve of force over velocity. Which law
of the catalogue removes most is then an answer, and their sum is none.
"""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.elimination.holdout_support import choose_smaller
from rtctl.diagnosis.search.outcome import SearchResult

DISSIPATION = {
    "damping.nonlinear", "damping.quadratic", "damping.power",
    "friction.coulomb", "friction.stribeck", "friction.presliding", "hysteresis.bouc_wen",
}  # fmt: skip


def keep_one_dissipation_law(
    result: SearchResult, problem: Problem, ids: Sequence[str]
) -> tuple[SearchResult, tuple[str, ...]]:
    """Drop the laws of dissipation beside the strongest from a set that does not pass, the weakest first.

    Args:
        result: Outcome of a search.
        problem: Records that were fitted.
        ids: Mechanisms of the catalogue that are tested.

    Returns:
        The outcome with one law of dissipation at most, and the ids of the others.
    """
    dropped: list[str] = []
    while not result.passes:
        names = set(result.chosen.hypothesis.mechanisms)
        fewer = [one for one in result.leave_one_out if (names - set(one.mechanisms)) & DISSIPATION]
        if len(names & DISSIPATION) < 2 or not fewer:
            break
        kept = min(fewer, key=lambda one: one.cost)
        dropped += names - set(kept.mechanisms)
        result = choose_smaller(kept, result, problem, ids)
    return result, tuple(dropped)
