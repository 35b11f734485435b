"""The ranking of cause sets that a report shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.model_selection import RankedHypothesis

SAME_LAW = " (the same law: {})"


def ranking_of(diagnosis: Diagnosis) -> list[tuple[str, RankedHypothesis]]:
    """Return label and fit of each set of the chosen size, or of the largest size tried, lowest BIC first.

    A cause that is one law with another stands for both. The search tries the other only where it is a law of its own,
    which has no place beside the cause.
    """
    sizes = diagnosis.search.rankings
    size = len(diagnosis.search.chosen.hypothesis.mechanisms)
    ranking = next(
        (r for r in sizes if r and len(r[0].hypothesis.mechanisms) == size), sizes[-1] if sizes else ()
    )
    same_laws = {cause.id: cause.same_law for cause in diagnosis.causes if cause.same_law}
    twins = stand_ins(diagnosis.search.chosen.hypothesis.mechanisms, same_laws)
    return [
        (label_of(one.hypothesis.mechanisms, same_laws), one)
        for one in ranking
        if frozenset(one.hypothesis.mechanisms) not in twins
    ]


def label_of(mechanisms: Sequence[str], same_laws: Mapping[str, Sequence[str]]) -> str:
    """Return the names of a set, each with those that are one law with it."""
    return " + ".join(
        one + (SAME_LAW.format(", ".join(same_laws[one])) if same_laws.get(one) else "") for one in mechanisms
    )


def stand_ins(mechanisms: Sequence[str], same_laws: Mapping[str, Sequence[str]]) -> set[frozenset[str]]:
    """Return the sets in which another mechanism of the same law stands in place of one of `mechanisms`."""
    return {frozenset(mechanisms) - {one} | {other} for one in mechanisms for other in same_laws.get(one, ())}
