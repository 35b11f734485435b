"""The ranking of cause sets that a report shows."""

from __future__ import annotations

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.result import Diagnosis


def ranking_of(diagnosis: Diagnosis) -> list[tuple[str, Hypothesis]]:
    """Return label and hypothesis of each set of the chosen size, or of the largest size tried, best first."""
    sizes = diagnosis.search.rankings
    size = len(diagnosis.search.chosen.hypothesis.mechanisms)
    ranking = next(
        (r for r in sizes if r and len(r[0].hypothesis.mechanisms) == size), sizes[-1] if sizes else ()
    )
    return [(" + ".join(one.hypothesis.mechanisms), one.hypothesis) for one in ranking]
