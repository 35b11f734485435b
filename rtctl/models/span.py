"""A closed range of one quantity."""

from __future__ import annotations

from typing import NamedTuple


class Span(NamedTuple):
    """Closed range, in the unit that its owner declares."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """Difference high - low."""
        return self.high - self.low
