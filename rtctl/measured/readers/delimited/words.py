"""Cells of a text file that are no plain numbers: marks of a gap, numbers of Fortran, a header that comes again."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pyarrow.csv
from numpy.typing import NDArray

_FORTRAN = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[dD]\s?([+-]?\d{1,3})|[eE]([+-]?\d{1,3})|([+-]\d{3}))?\s*"
)
"""A number as Fortran writes it: `1.0D-04`; an exponent of three digits may lack its letter, `1.0-104`."""
_SPREADSHEET_ERROR = re.compile(r"#(N/?A|NULL|VALUE|DIV/0|REF|NAME|NUM)[!?]?", re.IGNORECASE)
COMMENTS = ("#", "%")
"""Marks of comments."""
_SHOWN = 40
_LOOKED_AT = 1000
"""Cells by which a column of text is told from one of numbers with some text."""


@cache
def _gaps() -> frozenset[str]:
    return frozenset(pyarrow.csv.ConvertOptions().null_values)


def is_gap(cell: str) -> bool:
    """Return whether a cell stands for a reading that there is not, also as a spreadsheet's error: `#N/A`."""
    return cell in _gaps() or _SPREADSHEET_ERROR.fullmatch(cell) is not None


def shown(line: str) -> str:
    """Return a line as it is cited."""
    text = " ".join(line.replace('"', "").split())
    text = "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)
    return f"{text[:_SHOWN]}{'...' if len(text) > _SHOWN else ''}"


def of_words(cells: NDArray[Any], names: Sequence[str], first_row: int) -> NDArray[Any]:
    """Return cells (n,) of text, from row `first_row` on, as the numbers of Fortran that all are, else as they are.

    Raises:
        ValueError: Among numbers stands the name of a column, as where a second table begins, or a comment.
    """
    first = [cell for cell in cells[:_LOOKED_AT] if cell]
    if 2 * sum(_FORTRAN.fullmatch(str(cell)) is None for cell in first) > len(first):
        return cells  # dates, words: not worth a look at each of many
    found = [None if cell is None or cell == "" else _FORTRAN.fullmatch(str(cell)) for cell in cells]
    wrong = [k for k, one in enumerate(found) if one is None and not is_gap(str(cells[k] or ""))]
    if 2 * len(wrong) > len(cells):
        return cells
    known = {name for name in names if name}
    for row in wrong:
        if str(cells[row]).strip() in known:
            raise ValueError(_about_names(first_row + row))
        if str(cells[row]).lstrip().startswith(COMMENTS):
            raise ValueError(
                f"has a comment in row {first_row + row} (counted from 0), among the numbers: remove that line; where "
                "the measurement was interrupted there, divide the file"
            )
    if wrong or not any(one is not None and (one[2] or one[4]) for one in found):
        return cells
    return np.array([np.nan if one is None else _value(one) for one in found])


def _about_names(row: int) -> str:
    return (
        f"the line of names comes again in row {row} (counted from 0): several tables stand one below the other. "
        "Divide the file above that line, and give all parts: rtctl init FILE FILE; if the line is there by mistake, "
        "remove it"
    )


def _value(found: re.Match[str]) -> float:
    return float(f"{found[1]}e{found[2] or found[3] or found[4] or '0'}")
