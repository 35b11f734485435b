"""An identified VO2 model as a C plant, translated from `rtctl.simulations.vo2.stepping`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CRequest, CVariable, steps_kept
from rtctl.border.simulation import FreeParameter
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.model import vo2_simulation
from rtctl.simulations.vo2.simulation import STEPS_PER_TIME_CONSTANT, Vo2Simulation
from rtctl.simulations.vo2.stepping.march import march_advance, march_look, march_start
from rtctl.simulations.vo2.stepping.memory import memory_record
from rtctl.simulations.vo2.stepping.values import (
    FULL_NAMES,
    constants_of,
    neutral_values,
    parameters_of,
)
from rtctl.translation.c99.arithmetic import ARITHMETIC
from rtctl.translation.c99.program import function_lines, type_lines, wrapped
from rtctl.translation.c99.tables import constant_lines, record_lines
from rtctl.translation.inference import Program
from rtctl.translation.instances import struct_of_values
from rtctl.translation.types import REAL, StructType

FOLDER = Path(__file__).parent
UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
REASONS = {
    "timing.skew": "the reading of a row at another instant is a matter of the recording, not of the plant"
}
"""Why mechanisms have no form in C."""


def vo2_plant(model: Vo2Model, source: str, request: CRequest) -> CPlant:
    """Return the model as a C plant, in mA, ohm and um.

    It starts on the branch that a full cooling leaves, at rest in its first current.

    Raises:
        InputError: A mechanism of the model has no form in C; it is named.
    """
    simulation = vo2_simulation(model, UNITS, source)
    acting = [one.id for one in simulation.acting()]
    refused = [f"{source}: {one} has no form in C: {REASONS[one]}" for one in acting if one in REASONS]
    if refused:
        raise InputError("\n".join(refused))
    shown = [one for one in simulation.parameters if one.mechanism in ("", *acting)]
    period_s = request.stimuli[0].period_s if request.stimuli else None
    proposed = float(f"{model.time_constant_s / STEPS_PER_TIME_CONSTANT:.1e}")
    step_s = request.step_s or period_s or proposed
    longest_s, between = _resolved(simulation, period_s or step_s)
    delay_s = sum(one.value for one in shown if one.mechanism == "actuation.delay")
    kept = steps_kept(delay_s, step_s, f"{source}: actuation.delay") if delay_s > 0.0 else 1
    program = _Translated(model, shown, between, kept)
    return CPlant(
        kind="vo2",
        inputs=(CVariable(name="current", unit="mA", value=float(model.current.low), meaning="through the film"),),
        outputs=(
            CVariable(name="resistance", unit="ohm"),
            CVariable(name="deflection", unit="um"),
            CVariable(name="surrogate", unit="mA", meaning="current that holds the present temperature"),
        ),
        states=(),
        parameters=tuple(
            CVariable(
                name=one.name, unit=one.unit, value=one.value, meaning=one.declared.meaning,
                low=one.low if math.isfinite(one.low) else None, high=one.high if math.isfinite(one.high) else None,
            )
            for one in shown
        ),
        memory=sum(max(field.size, 1) for field in program.memory.fields),
        step_s=step_s,
        longest_step_s=longest_s,
        method="heating exact over a step, two Preisach read-outs",
        source=program.text(),
        mechanisms=tuple(acting),
        direct=((), (), ()),
    )  # fmt: skip


def _resolved(simulation: Vo2Simulation, period_s: float) -> tuple[float, bool]:
    """Return the substep [s] of the simulation, and whether it takes readings between samples."""
    values = np.array([one.value for one in simulation.parameters])
    substeps, between = simulation.instants(values, period_s)
    return period_s / substeps, between


class _Translated:
    """The stepping functions of a model as C."""

    def __init__(self, model: Vo2Model, shown: list[FreeParameter], between: bool, kept: int) -> None:
        self._shown, self._kept = [one.name for one in shown], kept
        creeps = any(one.startswith("hysteresis.creep") for one in self._shown)
        self._constants = constants_of(model, between=between, creeps=creeps)
        self.memory = memory_record(kept)
        structs: dict[type, StructType] = {}
        constants = struct_of_values(self._constants, structs)
        parameters = struct_of_values(parameters_of({}), structs)
        self._program = Program(structs)
        passed = [parameters, constants]
        self._program.add(march_start, [self.memory, REAL, *passed], [0] * 4)
        self._program.add(march_look, [self.memory, REAL, *passed], [0] * 4)
        self._program.add(march_advance, [self.memory, REAL, REAL, REAL, REAL, *passed], [0] * 7)

    def text(self) -> str:
        """Return the source."""
        return f"{wrapped(self._lines())}\n{(FOLDER / 'unit.c').read_text(encoding='utf-8')}"

    def _lines(self) -> Iterator[str]:
        yield "#include <string.h>\n#define RTCTL_LIBM"
        yield ARITHMETIC.read_text(encoding="utf-8")
        yield from type_lines(self._program)
        yield from record_lines(self.memory)
        yield from constant_lines("CONSTANTS", self._constants, {})
        yield from function_lines(self._program)
        yield from self._parameters()
        yield f'#define KEPT "{self._kept}"'

    def _parameters(self) -> Iterator[str]:
        """Yield the function that hands the unit's parameters on; those that it has not are neutral."""
        neutral = neutral_values()
        yield "static Parameters parameters_of(const double *value)\n{\n    return (Parameters){"
        for group, fields in FULL_NAMES.items():
            inside = ", ".join(
                f".{field} = " + (f"value[{self._shown.index(full)}]" if full in self._shown else repr(neutral[full]))
                for field, full in fields.items()
            )  # fmt: skip
            yield f"        .{group} = {{{inside}}},"
        yield "    };\n}"
