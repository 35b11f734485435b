"""Constants and records as C99: structs with units, tables, the state's first values."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rtctl.translation.c99.expressions import c_number
from rtctl.translation.c99.statements import STEP, WIDTH, comment, declared
from rtctl.translation.memory import ByPrecision, Memory
from rtctl.translation.types import INT, LONG, REAL, ArrayType, RecordType, StructType


def struct_lines(struct: StructType) -> list[str]:
    """Return the definition of a NamedTuple, with the sentences of its docstrings."""
    own, notes = _notes(struct.source)
    lines = [*(comment(own) if own else []), "typedef struct {"]
    for name, kind in struct.fields:
        view = "real_table" if isinstance(kind, ArrayType) and kind.dimensions == 2 else declared(kind, True)
        lines.append(f"{STEP}{view} {name};" + _trailing(notes.get(name, "")))
    return [*lines, f"}} {struct.name};"]


def _notes(source: type) -> tuple[str, dict[str, str]]:
    """Return the docstring of a class and those of its fields."""
    try:
        node = ast.parse(textwrap.dedent(inspect.getsource(source))).body[0]
    except (OSError, TypeError):
        return "", {}  # a NamedTuple without a text of its own
    if not isinstance(node, ast.ClassDef):
        return "", {}
    notes = {}
    for field, text in zip(node.body, node.body[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
        ):
            value = text.value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                notes[field.target.id] = value.value
    return ast.get_docstring(node) or "", notes


def record_lines(record: RecordType) -> list[str]:
    """Return the definition of a record."""
    lines = ["typedef struct {"]
    for field in record.fields:
        if isinstance(field.type, ArrayType):
            text = f"real_t {field.name}[{field.size}];"
        else:
            text = f"{field.type.value} {field.name};"
        lines.append(f"{STEP}{text}{_trailing(field.comment)}")
    return [*lines, f"}} {record.name};"]


def _trailing(text: str) -> str:
    text = " ".join(text.split())
    return f" /* {text} */" if text else ""


def constant_lines(name: str, values: Any, sources: Mapping[str, str]) -> list[str]:
    """Return the definition of a NamedTuple of NamedTuples of constants, its arrays before it."""
    tables: list[str] = []
    inside = list(_fields(values, (), tables, sources, 1))
    kind = type(values).__name__
    return [*tables, f"static const {kind} {name} = {{", *inside, "};"]


def _fields(
    values: Any, path: tuple[str, ...], tables: list[str], sources: Mapping[str, str], depth: int
) -> Iterator[str]:
    pad = STEP * depth
    for name, value in zip(values._fields, values, strict=True):
        here = (*path, name)
        source = _trailing(sources.get(".".join(here), ""))
        if isinstance(value, tuple):
            yield f"{pad}.{name} = {{{source}"
            yield from _fields(value, here, tables, sources, depth + 1)
            yield f"{pad}}},"
        elif isinstance(value, np.ndarray):
            table = "_".join(here)
            sizes = f"{value.size}" if value.ndim == 1 else f"{value.shape[0]}, {value.shape[1]}"
            if value.ndim == 2:
                value = _below_diagonal(table, value)
            tables.extend(_table_lines(table, value, sources.get(".".join(here), "")))
            yield f"{pad}.{name} = {{{table}, {sizes}}},"
        else:
            kind = INT if isinstance(value, int) else REAL
            text = c_number(value, kind)
            if isinstance(value, ByPrecision):
                text = f"BY_PRECISION({float(value)!r}, {value.single!r})"
            yield f"{pad}.{name} = {text},{source}"


def _below_diagonal(name: str, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return what of a square table is stored: an Everett function is zero on its diagonal and right of it."""
    if np.triu(values).any():
        raise ValueError(f"{name}: a table has to be zero on its diagonal and right of it")
    return values[np.tril_indices(len(values), -1)]


def _table_lines(name: str, values: np.ndarray[Any, Any], source: str) -> list[str]:
    numbers = ", ".join(c_number(value, REAL) for value in np.ravel(values).tolist())
    body = textwrap.wrap(numbers, WIDTH - len(STEP))
    return [
        *(comment(source) if source else []),
        f"static const real_t {name}[{values.size}] = {{", *(STEP + line for line in body), "};", "",
    ]  # fmt: skip


def first_value_lines(memory: tuple[Memory, ...]) -> list[str]:
    """Return statements that set a state which is all zero to its first values."""
    lines = []
    for entry in memory:
        if isinstance(entry.value, np.ndarray):
            lines += [
                f"{STEP}s->{entry.name}[{k}] = {c_number(value, REAL)};"
                for k, value in enumerate(entry.value.tolist())
                if value != 0.0
            ]
        elif entry.value != 0:
            kind = entry.field.type
            value = int(entry.value) if kind in (INT, LONG) else float(entry.value)
            lines.append(f"{STEP}s->{entry.name} = {c_number(value, kind)};")
    return lines
