"""A translated law as the files of a C99 library."""

from __future__ import annotations

from rtctl.export.c.laws.law import Law
from rtctl.translation.c99.program import function_lines, type_lines, wrapped
from rtctl.translation.c99.statements import comment
from rtctl.translation.c99.tables import constant_lines, first_value_lines, record_lines
from rtctl.translation.inference import Program
from rtctl.translation.instances import Instance


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
    return "\n".join([*lines, *type_lines(program), "", "#endif", ""])


def functions(law: Law, program: Program, entry: Instance, heading: str) -> str:
    """Return `rtctl.c`: all functions, in the order of their modules, callees first."""
    lines = [*comment(heading), '#include "rtctl.h"', '#include "rtctl_tables.h"', ""]
    lines += function_lines(program)
    lines += [
        "void rtctl_init(rtctl_state *s)", "{", "    uint8_t *byte = (uint8_t *)s;",
        "    for (uint32_t k = 0; k < sizeof *s; k++) {", "        byte[k] = 0;", "    }",
        *first_value_lines(law.memory), "}", "",
        "void rtctl_step(rtctl_state *s, const rtctl_in *in, rtctl_out *out)", "{",
        f"    {entry.name}(s, in, out, &CONSTANTS);", "}", "",
    ]  # fmt: skip
    return wrapped(lines)
