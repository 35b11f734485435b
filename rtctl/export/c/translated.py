"""A law with its kernels translated: what the printers take."""

from __future__ import annotations

from typing import NamedTuple

from rtctl.export.c.laws.law import Law
from rtctl.translation.inference import Program
from rtctl.translation.instances import Instance, struct_of_values
from rtctl.translation.types import RecordArray, StructType


class Translated(NamedTuple):
    """A law and its kernels."""

    law: Law
    program: Program
    entry: Instance


def translated(law: Law) -> Translated:
    """Translate a law. Raises NotTranslatableError."""
    structs: dict[type, StructType] = {}
    constants = struct_of_values(law.constants, structs)
    program = Program(structs)
    entry = program.add(law.sample, [RecordArray(law.state), law.input, law.output, constants], [0, 0, 0, 0])
    return Translated(law, program, entry)
