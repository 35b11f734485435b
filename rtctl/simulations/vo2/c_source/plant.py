"""An identified VO2 model as a C plant: heating, two Preisach read-outs, gains and offsets of its signals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CRequest, CVariable
from rtctl.hysteresis.preisach.model import MAX_EXTREMA, PreisachParams
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.model import vo2_simulation
from rtctl.simulations.vo2.nominal import middle, middle_reading

FOLDER = Path(__file__).parent
UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
STEPS_PER_TIME_CONSTANT = 8.0
"""Communication steps that are proposed in a time constant of the heating."""
IN_SOURCE = frozenset({"input.gain_drift", "sensor.ageing", "sensor.drift", "sensor.quantisation"})
"""Mechanisms that `march.c` has."""
REMEMBERED = 2
"""Numbers besides those of both read-outs."""


def vo2_plant(model: Vo2Model, source: str, request: CRequest) -> CPlant:
    """Return the model as a C plant, in mA, ohm and um.

    It starts on the branch that a full cooling leaves, at rest in its first current.

    Raises:
        InputError: A mechanism of the model has no form in C; it is named.
    """
    simulation = vo2_simulation(model, UNITS, source)
    acting = [one.id for one in simulation.acting()]
    without_form = [identity for identity in acting if identity not in IN_SOURCE]
    if without_form:
        raise InputError(
            f"{source}: {', '.join(without_form)} has no form in C yet: of mechanisms a VO2 unit has "
            f"{', '.join(sorted(IN_SOURCE))}; take the tables out to export the rest"
        )
    shown = [one for one in simulation.parameters if one.mechanism in ("", *acting)]
    period_s = request.stimuli[0].period_s if request.stimuli else None
    proposed = float(f"{model.time_constant_s / STEPS_PER_TIME_CONSTANT:.1e}")
    step_s = request.step_s or period_s or proposed
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
        memory=REMEMBERED + 2 * (1 + 2 * MAX_EXTREMA),
        step_s=step_s,
        longest_step_s=period_s or step_s,
        method="heating exact over a step, two Preisach read-outs",
        source="\n".join(_source(model, [one.name for one in shown], acting)),
        mechanisms=tuple(acting),
        direct=((), (), ()),
    )  # fmt: skip


def _source(model: Vo2Model, names: Sequence[str], acting: Sequence[str]) -> Iterator[str]:
    """Yield the parts of the source."""
    yield f"#include <math.h>\n#include <string.h>\n\n#define EXTREMA {MAX_EXTREMA}"
    for k, name in enumerate(names):
        yield f"#define {_c_name(name)} value[{k}]"
    for identity in acting:
        yield f"#define HAS_{_c_name(identity)}"
    middles = {
        "CURRENT_MIDDLE": middle(model.current),
        "READING_MIDDLE": middle_reading(model.resistance),
        "DEFLECTION_MIDDLE": middle(model.deflection),
    }
    for name, number in middles.items():
        yield f"#define {name} ({number!r}) /* about which the gain turns */"
    yield (FOLDER / "preisach.c").read_text(encoding="utf-8")
    yield from _read_out("film", model.resistance_preisach.params)
    yield from _read_out("beam", model.deflection_preisach.params)
    yield (FOLDER / "march.c").read_text(encoding="utf-8")


def _c_name(name: str) -> str:
    return name.replace(".", "_").upper()


def _read_out(name: str, params: PreisachParams) -> Iterator[str]:
    yield _table(f"{name}_grid", params.grid)
    yield _table(f"{name}_nodes", params.nodes)
    constants = ", ".join(repr(float(one)) for one in (params.sign, params.c, params.c1, params.c2))
    yield f"static const preisach {name} = {{{params.grid.size}, {name}_grid, {name}_nodes, {constants}}};"


def _table(name: str, values: FloatArray) -> str:
    rows = np.atleast_2d(values)
    text = ",\n    ".join(", ".join(repr(float(one)) for one in row) for row in rows)
    return f"static const double {name}[] = {{\n    {text}\n}};"
