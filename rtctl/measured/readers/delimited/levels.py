"""Names of columns in several lines with that of the first column below them, as pandas writes a header of levels.

signal,drive,displacement
unit,V,mm
t,,
"""

from __future__ import annotations

from collections.abc import Callable, Sequence


def without_levels(block: Sequence[list[str]], are_units: Callable[[list[str]], bool]) -> list[list[str]]:
    """Return the lines above the numbers as one of names, and one of units where the lowest level has these."""
    *levels, last = block
    width = len(last)
    if (
        not levels
        or not last[0]
        or any(last[1:])
        or any(len(one) != width or not all(one[1:]) for one in levels)
    ):
        return list(block)
    units = [["", *levels.pop()[1:]]] if len(levels) > 1 and are_units(levels[-1][1:]) else []
    names = [" ".join(dict.fromkeys(parts)) for parts in zip(*(one[1:] for one in levels), strict=True)]
    return [[last[0], *names], *units]
