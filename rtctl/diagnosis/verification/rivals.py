"""The hypotheses that a next experiment has to tell apart."""

from __future__ import annotations

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.thresholds import VerificationThresholds
from rtctl.diagnosis.verification.verdict import Verdict


def choose_rivals(
    search: SearchResult, verdict: Verdict, thresholds: VerificationThresholds
) -> list[Hypothesis]:
    """Return the sets of causes that the data do not tell apart, or the best single causes where none is named.

    What the data refute already is no rival of causes that are named, whether or not these explain everything.
    """
    if verdict.names_causes:
        equivalent = [search.chosen.hypothesis, *search.equivalent][: thresholds.max_rivals]
        return equivalent if search.equivalent else []
    if verdict.claim == "adequate" or not search.rankings:
        return []
    return [one.hypothesis for one in search.rankings[0][: thresholds.max_unexplained_rivals]]
