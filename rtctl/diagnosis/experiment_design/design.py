"""The design of the next experiment: which inputs, and how many records of each, as few as decide.

A design is either one input, repeated until it decides, or a sequence of records, each of the input that adds most to
those before it. One input may tell what another needs known, as a resonance tells the damping beside which a lag
becomes visible.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from rtctl.diagnosis.experiment_design.candidate_inputs import CandidateInput
from rtctl.diagnosis.experiment_design.t_optimality import Comparison
from rtctl.diagnosis.thresholds import ExperimentThresholds


class ScoredInput(NamedTuple):
    """A candidate input and the least separation that one record of it would bring."""

    input: CandidateInput
    """The candidate input."""
    separation: float
    """Separation of the two closest candidates by one record [standard errors]."""
    whole: bool = True
    """Whether no prediction parts from the others. Where one does, only the part before counts, and a fit may not find
    back after it."""


class Design(NamedTuple):
    """Inputs, the number of records of each, and the least separation that all of them bring."""

    records: tuple[tuple[ScoredInput, int], ...]
    """Inputs with the number of records of each."""
    separation: float
    """Separation of the two closest candidates by all records [standard errors]."""

    @property
    def times(self) -> int:
        """Number of records of all inputs."""
        return sum(times for _, times in self.records)

    @property
    def whole(self) -> bool:
        """Whether no prediction parts from the others under any of the inputs."""
        return all(scored.whole for scored, _ in self.records)


Proposal = tuple[ScoredInput, Comparison]
LeastSeparation = Callable[[Comparison], float]
"""Returns the separation [standard errors] of the two candidates that such records leave closest."""


def find_design(
    proposals: Sequence[Proposal], least: LeastSeparation, limits: ExperimentThresholds
) -> Design:
    """Return the design that decides with the fewest records, else the one that separates most.

    Designs under which no prediction parts from the others are preferred. The input may be another than the best of one
    record: what that one owes to the data so far does not grow with the number of records.

    Args:
        proposals: All candidate inputs with their scores.
        least: Returns the least separation of records [standard errors].
        limits: Thresholds of the design.
    """
    designs = [_repeat_input(proposal, least, limits) for proposal in proposals]
    if max(scored.separation for scored, _ in proposals) >= limits.alike_separation:
        designs.append(_add_inputs(proposals, least, limits))
        whole = [proposal for proposal in proposals if proposal[0].whole]
        if whole and len(whole) < len(proposals):
            designs.append(_add_inputs(whole, least, limits))
    return choose_design(designs, limits)


def choose_design(designs: Sequence[Design], limits: ExperimentThresholds) -> Design:
    """Return the shortest design that decides, the simpler of two as short; else the one that separates most.

    A design under which predictions part is chosen only where no other decides, since a fit may not find back after
    that.
    """
    deciding = [design for design in designs if design.separation >= limits.deciding_separation]
    if deciding:
        best = [design for design in deciding if design.whole] or deciding
        return min(best, key=lambda design: (design.times, len(design.records), -design.separation))
    separating = [
        design for design in designs if design.whole and design.separation >= limits.alike_separation
    ]
    return max(separating or designs, key=lambda design: design.separation)


def _repeat_input(proposal: Proposal, least: LeastSeparation, limits: ExperimentThresholds) -> Design:
    """Return as many records of one input as decide: `max_records` where fewer do not, one where it separates nothing.

    Args:
        proposal: The input with its score.
        least: Returns the least separation of records [standard errors].
        limits: Thresholds of the design.
    """
    scored, comparison = proposal
    separation = scored.separation
    if separation >= limits.deciding_separation or separation < limits.alike_separation:
        return Design(((scored, 1),), separation)
    few, many = 1, limits.max_records
    separation = least(comparison.add(comparison, many - 1))
    while separation >= limits.deciding_separation and many - few > 1:  # it grows with the number of records
        middle = (few + many) // 2
        reached = least(comparison.add(comparison, middle - 1))
        if reached >= limits.deciding_separation:
            many, separation = middle, reached
        else:
            few = middle
    return Design(((scored, many),), separation)


def _add_inputs(
    proposals: Sequence[Proposal], least: LeastSeparation, limits: ExperimentThresholds
) -> Design:
    """Return a sequence of records, each of the input that adds most, until they decide.

    Args:
        proposals: Inputs to choose from, with their scores.
        least: Returns the least separation of records [standard errors].
        limits: Thresholds of the design.
    """
    first = max(range(len(proposals)), key=lambda k: proposals[k][0].separation)
    counts, together, separation = {first: 1}, proposals[first][1], proposals[first][0].separation
    while separation < limits.deciding_separation and sum(counts.values()) < limits.max_records:
        extended = [together.add(comparison) for _, comparison in proposals]
        reached = [least(comparison) for comparison in extended]
        best = reached.index(max(reached))
        together, separation = extended[best], reached[best]
        counts[best] = counts.get(best, 0) + 1
    return Design(tuple((proposals[k][0], times) for k, times in counts.items()), separation)
