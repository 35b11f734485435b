"""Values that a translated program begins with: constants of two precisions, fields of its memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.translation.types import INT, LONG, REAL, ArrayType, Field


class ByPrecision(float):
    """A constant of double precision that has another value in single precision."""

    single: float


def by_precision(double: float, single: float) -> ByPrecision:
    """Return the constant."""
    made = ByPrecision(double)
    made.single = single
    return made


@dataclass(frozen=True, slots=True)
class Memory:
    """A field of the state with its value at the start."""

    name: str
    value: float | int | np.int64 | FloatArray
    comment: str = ""

    @property
    def field(self) -> Field:
        """Return the field of the record."""
        if isinstance(self.value, np.ndarray):
            return Field(self.name, ArrayType(), self.value.size, self.comment)
        kind = LONG if isinstance(self.value, np.int64) else INT if isinstance(self.value, int) else REAL
        return Field(self.name, kind, 0, self.comment)
