"""An instance of a kernel: its source, its types, and what it calls; NamedTuples as types."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.translation.mutation import roots_of
from rtctl.translation.source import NotTranslatableError, Source
from rtctl.translation.types import BOOL, INT, LONG, REAL, ArrayType, StructType, Type

INT_RANGE = range(-(2**31), 2**31)


@dataclass(slots=True, eq=False)
class Instance:
    """A kernel for the types of its arguments."""

    name: str
    source: Source
    parameters: dict[str, Type]
    mutated: frozenset[str]
    """Parameters that it changes in place."""
    sizes: dict[str, int]
    """Most entries of each array that is a parameter or a name for one."""
    types: dict[ast.AST, Type] = field(default_factory=dict)
    calls: dict[ast.Call, Instance] = field(default_factory=dict)
    constants: dict[str, float | int] = field(default_factory=dict)
    locals: dict[str, Type] = field(default_factory=dict)
    returns: Type = None

    def roots(self) -> dict[str, str]:
        """Return which parameter each name stands for a part of."""
        return roots_of(self.source)


def annotated(hint: Any) -> Type:
    """Return the type of an annotated field of a NamedTuple. Raises NotTranslatableError."""
    known: dict[Any, Type] = {float: REAL, int: INT, bool: BOOL}
    if hint not in known:
        raise NotTranslatableError(f"a NamedTuple's field of type {hint!r} has no counterpart in C")
    return known[hint]


def struct_of_values(values: Any, structs: dict[type, StructType]) -> StructType:
    """Return the type of a NamedTuple of constants by its values; note it, and those in it, in `structs`."""
    fields = []
    for name, value in zip(values._fields, values, strict=True):
        if isinstance(value, tuple):
            kind: Type = struct_of_values(value, structs)
        elif isinstance(value, np.ndarray):
            kind = ArrayType(value.ndim)
        else:
            kind = BOOL if isinstance(value, bool) else INT if isinstance(value, int) else REAL
            if kind is INT and value not in INT_RANGE:
                kind = LONG
        fields.append((name, kind))
    made = StructType(type(values).__name__, type(values), tuple(fields))
    structs[type(values)] = made
    return made
