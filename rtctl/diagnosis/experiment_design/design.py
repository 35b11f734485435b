"""Which inputs, and how many records of each: as few as decide.

Either one input, as often as it takes, or one record after the other, each of the input that adds most to what those
before it leave: one may tell what another needs known, as a resonance tells the damping beside which a lag shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from rtctl.diagnosis.experiment_design.candidate_inputs import Input
from rtctl.diagnosis.experiment_design.t_optimality import Played

DECIDES = 8.0
"""Standard errors between two candidates. Where the data so far are even, 98 % of records that bring 6 leave one by
`search.EQUIVALENT`; but what is to be told apart is known as well as these few data know it, and its square enters.
"""
MOST_TIMES = 16
"""Records that are proposed where fewer do not decide."""
ALIKE = 0.1
"""Standard errors from one record: below, candidates answer alike."""


class Scored(NamedTuple):
    """An input and the least separation [standard errors] that one record of it would bring."""

    input: Input
    separation: float
    whole: bool = True
    """No prediction parts from the others: else only what comes before counts, and a fit may not find back after it."""


class Planned(NamedTuple):
    """Inputs, the records of each, and the least separation [standard errors] that all of them bring."""

    records: tuple[tuple[Scored, int], ...]
    separation: float

    @property
    def times(self) -> int:
        """Records."""
        return sum(times for _, times in self.records)

    @property
    def whole(self) -> bool:
        """Whether under none of the inputs a prediction parts from the others."""
        return all(scored.whole for scored, _ in self.records)


Proposal = tuple[Scored, Played]
Least = Callable[[Played], float]
"""Separation [standard errors] of the two candidates that such records leave closest."""


def planned(possible: Sequence[Proposal], least: Least) -> Planned:
    """Of all inputs, `possible`, those that decide with the fewest records, without predictions that part if there are
    such; else those that bring most.

    It may be another than the best of one record: what that owes to the data so far does not grow with their number.
    """
    plans = [_repeated(one, least) for one in possible]
    if max(scored.separation for scored, _ in possible) >= ALIKE:
        plans.append(_one_after_the_other(possible, least))
        whole = [one for one in possible if one[0].whole]
        if whole and len(whole) < len(possible):
            plans.append(_one_after_the_other(whole, least))
    return chosen(plans)


def chosen(plans: Sequence[Planned]) -> Planned:
    """The shortest that decides, the simpler of two as short; else that which brings most.

    Those under which predictions part only where no other would do, since a fit may not find back after it.
    """
    deciding = [plan for plan in plans if plan.separation >= DECIDES]
    if deciding:
        best = [plan for plan in deciding if plan.whole] or deciding
        return min(best, key=lambda plan: (plan.times, len(plan.records), -plan.separation))
    telling = [plan for plan in plans if plan.whole and plan.separation >= ALIKE] or plans
    return max(telling, key=lambda plan: plan.separation)


def _repeated(proposal: Proposal, least: Least) -> Planned:
    """As many records of one input as decide; MOST_TIMES where no number up to it does, one where it is in vain."""
    scored, played = proposal
    apart = scored.separation
    if apart >= DECIDES or apart < ALIKE:
        return Planned(((scored, 1),), apart)
    few, many, apart = 1, MOST_TIMES, least(played.and_also(played, MOST_TIMES - 1))
    while apart >= DECIDES and many - few > 1:  # it grows with their number
        middle = (few + many) // 2
        if (there := least(played.and_also(played, middle - 1))) >= DECIDES:
            many, apart = middle, there
        else:
            few = middle
    return Planned(((scored, many),), apart)


def _one_after_the_other(possible: Sequence[Proposal], least: Least) -> Planned:
    """Each the input that adds most, until they decide."""
    first = max(range(len(possible)), key=lambda k: possible[k][0].separation)
    counts, together, apart = {first: 1}, possible[first][1], possible[first][0].separation
    while apart < DECIDES and sum(counts.values()) < MOST_TIMES:
        further = [together.and_also(played) for _, played in possible]
        reached = [least(one) for one in further]
        best = reached.index(max(reached))
        together, apart = further[best], reached[best]
        counts[best] = counts.get(best, 0) + 1
    return Planned(tuple((possible[k][0], times) for k, times in counts.items()), apart)
