"""Types of the translated language: numbers, arrays of reals, NamedTuples of constants, records of memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any


class Scalar(Enum):
    """A number."""

    REAL = "real_t"
    INT = "int32_t"
    """Index, count or status bits."""
    LONG = "int64_t"
    """Counter or time of a device."""
    BOOL = "bool"


@dataclass(frozen=True, slots=True)
class ArrayType:
    """An array of reals; whether it can be changed is a property of the place it lies in."""

    dimensions: int = 1


@dataclass(frozen=True, slots=True)
class StructType:
    """A NamedTuple: constants, or what a kernel returns."""

    name: str
    source: type
    fields: tuple[tuple[str, Type], ...]

    def of(self, field: str) -> Type | None:
        """Return the type of a field; None if there is none of that name."""
        return dict(self.fields).get(field)


@dataclass(frozen=True, slots=True)
class TupleType:
    """What a function without a NamedTuple of its own returns."""

    items: tuple[Type, ...]


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a record."""

    name: str
    type: Scalar | ArrayType
    size: int = 0
    """Entries of an array."""
    comment: str = ""


@dataclass(frozen=True, slots=True)
class RecordType:
    """A record of memory that functions change: a row of a structured array."""

    name: str
    fields: tuple[Field, ...]

    def of(self, name: str) -> Type | None:
        """Return the type of a field; None if there is none of that name."""
        return next((field.type for field in self.fields if field.name == name), None)


@dataclass(frozen=True, slots=True)
class RecordArray:
    """An array of one record; its row is what functions change."""

    record: RecordType


@dataclass(frozen=True, slots=True)
class FunctionType:
    """A function that is handed on: each instance is written for the one that it calls."""

    function: Callable[..., Any]


Type = FunctionType | Scalar | ArrayType | StructType | TupleType | RecordType | RecordArray | None
REAL, INT, LONG, BOOL = Scalar.REAL, Scalar.INT, Scalar.LONG, Scalar.BOOL
NUMBERS = (BOOL, INT, LONG, REAL)
"""From the narrowest to the widest."""


def wider(one: Type, other: Type) -> Type:
    """Return the type that holds both numbers, or both as they are if they are the same. Raises ValueError."""
    if one == other:
        return one
    if one in NUMBERS and other in NUMBERS:
        return NUMBERS[max(NUMBERS.index(one), NUMBERS.index(other))]
    raise ValueError(f"{one} and {other} have no common type")
