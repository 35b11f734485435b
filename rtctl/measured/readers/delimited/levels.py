"""Lines between the names of columns and their numbers: levels of names, scales and limits of each column.

signal,drive,displacement    Channel;force;x
unit,V,mm                    Unit;N;mm
t,,                          Factor;10;0.5
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from rtctl.measured.readers.delimited.names import SEPARATORS, cells_of, is_number
from rtctl.measured.readers.stated.keys import is_scale_key

_LIMITS = re.compile(r"min(imum)?|max(imum)?|mean|average|mittelwert|rms|std(dev)?", re.IGNORECASE)
_LONGEST_KEY = 40


def is_of_columns(line: str) -> bool:
    """Return whether a line has a word for a scale or a limit, and behind it a number for each of several columns."""
    for separator in SEPARATORS:
        key, *cells = cells_of(line, separator) or [""]
        filled = [cell for cell in cells if cell]
        if len(filled) > 1 and all(map(is_number, filled)) and len(key) <= _LONGEST_KEY:
            return not is_number(key) and (is_scale_key(key) or _LIMITS.fullmatch(key) is not None)
    return False


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
