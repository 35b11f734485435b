"""A translated law as the files of a C99 library."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable

from rtctl.export.c.laws.law import Law
from rtctl.export.c.printing.c_expressions import c_number
from rtctl.export.c.printing.c_statements import Function, comment
from rtctl.export.c.printing.c_tables import constant_lines, first_value_lines, record_lines, struct_lines
from rtctl.export.c.translation.inference import Program
from rtctl.export.c.translation.instances import Instance
from rtctl.export.c.translation.types import INT, LONG, REAL, StructType

MOST = 110
"""Columns of a line of code."""


def header(law: Law, heading: str) -> str:
    """Return `rtctl.h`: what a program calls."""
    lines = [
        *comment(heading), "#ifndef RTCTL_H", "#define RTCTL_H", "", '#include "rtctl_arithmetic.h"', "",
        *comment("Memory of the loop: one for each device. Set by rtctl_init, changed by rtctl_step only."),
        *record_lines(law.state), "",
        *comment("What a sample needs."), *record_lines(law.input), "",
        *comment("What a sample gives."), *record_lines(law.output), "",
        *comment("Set a state to rest at the safe level: the first readings settle the device there."),
        "void rtctl_init(rtctl_state *s);", "",
        *comment("Take one sample: from a reading and a setpoint to the next command."),
        "void rtctl_step(rtctl_state *s, const rtctl_in *in, rtctl_out *out);", "", "#endif", "",
    ]  # fmt: skip
    return "\n".join(lines)


def tables(law: Law, heading: str) -> str:
    """Return `rtctl_tables.h`: the constants of a model."""
    lines = [
        *comment(heading),
        "#ifndef RTCTL_TABLES_H",
        "#define RTCTL_TABLES_H",
        "",
        '#include "rtctl_types.h"',
        "",
    ]
    lines += constant_lines("CONSTANTS", law.constants, law.sources)
    return "\n".join([*lines, "", "#endif", ""])


def types(program: Program) -> str:
    """Return `rtctl_types.h`: structs of constants and results, and the numbers that the functions name."""
    lines = ["#ifndef RTCTL_TYPES_H", "#define RTCTL_TYPES_H", "", '#include "rtctl_arithmetic.h"', ""]
    for struct in _in_order(program):
        lines += [*struct_lines(struct), ""]
    lines += [*_named_numbers(program.instances), "", "#endif", ""]
    return "\n".join(lines)


def functions(law: Law, program: Program, entry: Instance, heading: str) -> str:
    """Return `rtctl.c`: all functions, in the order of their modules, callees first."""
    lines = [*comment(heading), '#include "rtctl.h"', '#include "rtctl_tables.h"', ""]
    printed = [Function(instance) for instance in program.instances]
    lines += [line for one in printed for line in one.result_type()]
    lines += ["", *(f"{one.head()};" for one in printed), ""]
    for module in dict.fromkeys(instance.source.module for instance in program.instances):
        text = sys.modules[module].__doc__ or ""
        lines += [*comment(f"==== {module}\n\n{text.strip()}"), ""]
        for instance, one in zip(program.instances, printed, strict=True):
            if instance.source.module == module:
                lines += [*one.lines(), ""]
    lines += [
        "void rtctl_init(rtctl_state *s)", "{", "    uint8_t *byte = (uint8_t *)s;",
        "    for (uint32_t k = 0; k < sizeof *s; k++) {", "        byte[k] = 0;", "    }",
        *first_value_lines(law.memory), "}", "",
        "void rtctl_step(rtctl_state *s, const rtctl_in *in, rtctl_out *out)", "{",
        f"    {entry.name}(s, in, out, &CONSTANTS);", "}", "",
    ]  # fmt: skip
    return "\n".join(wrapped(line) for text in lines for line in text.split("\n"))


def wrapped(line: str) -> str:
    """Return a line of code broken after a comma or before an operator where it is too long."""
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
