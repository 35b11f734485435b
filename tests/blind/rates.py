"""Rates with their uncertainty, and Markdown tables.

Interval: Wilson (1927), Probable inference, the law of succession, and statistical inference; 95 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Line = dict[str, Any]
Z = 1.959964


class Rate(NamedTuple):
    """So many of so many."""

    count: int
    total: int

    @property
    def share(self) -> float:
        """NaN of none."""
        return self.count / self.total if self.total else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 %; all of 0 to 1 where nothing was counted."""
        if not self.total:
            return 0.0, 1.0
        n, p = self.total, self.share
        centre = (p + Z * Z / (2 * n)) / (1 + Z * Z / n)
        half = Z / (1 + Z * Z / n) * math.sqrt(p * (1 - p) / n + Z * Z / (4 * n * n))
        return max(0.0, centre - half), min(1.0, centre + half)

    def __str__(self) -> str:
        if not self.total:
            return "-"
        low, high = self.interval
        return f"{100 * self.share:.1f} % ({self.count} of {self.total}; {100 * low:.0f} to {100 * high:.0f})"


def rate(lines: Sequence[Line], hit: Callable[[Line], bool]) -> Rate:
    """Of the lines that are a hit."""
    return Rate(sum(bool(hit(line)) for line in lines), len(lines))


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)
