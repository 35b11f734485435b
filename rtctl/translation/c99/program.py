"""A translated program as C99: its structs and named numbers, and its functions, callees first."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable

from rtctl.translation.c99.expressions import c_number
from rtctl.translation.c99.statements import Function, comment
from rtctl.translation.c99.tables import struct_lines
from rtctl.translation.inference import Program
from rtctl.translation.instances import Instance
from rtctl.translation.types import INT, LONG, REAL, StructType

MOST = 110
"""Columns of a line of code."""


def type_lines(program: Program) -> list[str]:
    """Return structs of constants and results, and the numbers that the functions name."""
    lines = []
    for struct in _in_order(program):
        lines += [*struct_lines(struct), ""]
    return [*lines, *_named_numbers(program.instances)]


def function_lines(program: Program) -> list[str]:
    """Return all functions, in the order of their modules, callees first."""
    printed = [Function(instance) for instance in program.instances]
    lines = [line for one in printed for line in one.result_type()]
    lines += ["", *(f"{one.head()};" for one in printed), ""]
    for module in dict.fromkeys(instance.source.module for instance in program.instances):
        text = sys.modules[module].__doc__ or ""
        lines += [*comment(f"==== {module}\n\n{text.strip()}"), ""]
        for instance, one in zip(program.instances, printed, strict=True):
            if instance.source.module == module:
                lines += [*one.lines(), ""]
    return lines


def wrapped(lines: Iterable[str]) -> str:
    """Return lines of code as text, each broken after a comma or before an operator where it is too long."""
    return "\n".join(_broken(line) for text in lines for line in text.split("\n"))


def _broken(line: str) -> str:
    if len(line) <= MOST or line.lstrip().startswith(("*", "/*")):
        return line
    indent = len(line) - len(line.lstrip())
    found = textwrap.wrap(line.strip(), MOST - indent - 4, break_long_words=False, break_on_hyphens=False)
    return "\n".join(" " * (indent if k == 0 else indent + 4) + part for k, part in enumerate(found))


def _in_order(program: Program) -> list[StructType]:
    """Return all structs, those that are fields of others first."""
    ordered: dict[str, StructType] = {}

    def add(struct: StructType) -> None:
        for _, kind in struct.fields:
            if isinstance(kind, StructType):
                add(kind)
        ordered.setdefault(struct.name, struct)

    for struct in program.structs.values():
        add(struct)
    return list(ordered.values())


def _named_numbers(instances: Iterable[Instance]) -> list[str]:
    """Return definitions of the numbers that functions name. Raises ValueError where two have one name."""
    found: dict[str, float | int] = {}
    for instance in instances:
        for name, value in instance.constants.items():
            name = name.lstrip("_")
            if found.setdefault(name, value) != value:
                raise ValueError(
                    f"{name} is {found[name]} in one module and {value} in {instance.source.module}"
                )
    lines = []
    for name, value in sorted(found.items()):
        if isinstance(value, bool):
            continue
        kind = REAL if isinstance(value, float) else INT if abs(value) < 2**31 else LONG
        lines.append(f"#define {name} {c_number(value, kind)}")
    return lines
