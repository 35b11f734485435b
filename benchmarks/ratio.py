"""A cost beside another one of the same run: what a benchmark hands over as data."""

from __future__ import annotations

from typing import NamedTuple


class Ratio(NamedTuple):
    """What rtctl takes over what its peer takes, both measured by turns in one run; smaller is better."""

    name: str
    """What is timed."""
    peer: str
    """What it is timed beside."""
    cost: float
    """Of ours [unit]."""
    peer_cost: float
    """Of the peer [unit]."""
    unit: str
    """Of both costs."""
    of_rounds: float | None = None
    """Median of the rounds' own ratios, where rounds are pairs; None: the ratio of the costs is meant."""

    @property
    def value(self) -> float:
        """Return ours over the peer's."""
        return self.cost / self.peer_cost if self.of_rounds is None else self.of_rounds
