"""A closed range of one quantity."""

from __future__ import annotations

from typing import NamedTuple


class Span(NamedTuple):
    """A closed range, in the unit that its owner says."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """high - low."""
        return self.high - self.low
