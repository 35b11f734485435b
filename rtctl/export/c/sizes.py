"""Sizes of an exported loop in single precision, as its compiler lays it out."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.export.c.laws.law import Law
from rtctl.translation.types import INT, LONG, REAL, ArrayType

REAL_BYTES = 4


def state_bytes(law: Law) -> int:
    """Return the size of `rtctl_state` [byte]."""
    kinds = {REAL: np.float32, INT: np.int32, LONG: np.int64}
    fields = [
        (one.name, np.float32, (one.size,))
        if isinstance(one.type, ArrayType)
        else (one.name, kinds[one.type])
        for one in law.state.fields
    ]
    return int(np.dtype(fields, align=True).itemsize)


def table_bytes(law: Law) -> int:
    """Return the size of all constants [byte]; of a square table only what is left of its diagonal is stored."""
    return REAL_BYTES * _entries(law.constants)


def _entries(value: Any) -> int:
    if isinstance(value, tuple):
        return sum(map(_entries, value))
    if isinstance(value, np.ndarray):
        return value.size if value.ndim == 1 else len(value) * (len(value) - 1) // 2
    return 1
