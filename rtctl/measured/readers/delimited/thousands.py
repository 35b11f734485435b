"""Whole numbers with a mark of thousands, which read like decimals: 999, then 1.697 for 1,697."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEWEST = 10
"""Numbers of either sort below which nothing is told."""
LARGE = 100.0
"""Size that a whole number without a mark reaches where others have one."""


def may_have_thousands(values: NDArray[Any]) -> bool:
    """Return whether numbers (n,) are whole ones below 1000 and others that begin at 1 and are whole thousandths."""
    if values.dtype.kind != "f":
        return False
    size = np.abs(values[np.isfinite(values)])
    whole = size == np.round(size)
    marked, plain = size[~whole], size[whole]
    if len(marked) < FEWEST or len(plain) < FEWEST or marked.min() < 1.0:
        return False
    thousandths = 1000.0 * marked
    is_three = np.abs(thousandths - np.round(thousandths)) < 1e-6
    return bool(is_three.all() and LARGE <= plain.max() < 1000.0)


def check_thousands(texts: NDArray[Any], name: str, first_row: int, mark: str) -> None:
    """Raise ValueError where every number (n,) with a mark has three digits behind it, and others have no mark.

    Decimals that are written with three digits are all written so: 95.000 beside 95.250.
    """
    marked = [k for k, one in enumerate(texts) if one is not None and mark in str(one)]
    shape = re.compile(rf"\s*[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+\s*")
    if marked and len(marked) < len(texts) and all(shape.fullmatch(str(texts[k])) for k in marked):
        seen = str(texts[marked[0]]).strip()
        raise ValueError(
            f'column "{name}" has marks of thousands: {seen} in row {first_row + marked[0]} (counted from 0) stands '
            f'beside whole numbers below 1000, and every number with a "{mark}" has three digits behind it; export '
            "the file without them"
        )
