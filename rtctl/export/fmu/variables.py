"""The variables of a functional mock-up unit: names, value references, and where they stand in the C structure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CVariable
from rtctl.border.mechanisms import without_brackets

TIME = 0
"""Value reference of the time; those of the inputs follow, `FIRST_INPUT` in C."""
LONGEST_STEP = "longest_step"
SLOPE = "{name}_slope"
START = "{name}_start"


NO_BOUND = 1e300
"""Beyond it no number is taken."""


class Section(NamedTuple):
    """An array of the C structure `plant`, and how its variables behave."""

    field: str
    causality: str
    variability: str
    kind: str
    """Kind of variable in `component.c`."""


TIMES = Section("time", "independent", "continuous", "COMPUTED")
INPUTS = Section("input", "input", "continuous", "INPUT")
SLOPES = Section("slope", "input", "continuous", "SLOPE")
OUTPUTS = Section("output", "output", "continuous", "COMPUTED")
STATES = Section("state", "local", "continuous", "COMPUTED")
PARAMETERS = Section("parameter", "parameter", "tunable", "TUNABLE")
STARTS = Section("initial", "parameter", "fixed", "START")
STEP = Section("longest_step", "parameter", "tunable", "STEP_LENGTH")


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuVariable:
    """A variable; `variable.value` is its start where it has one."""

    reference: int
    section: Section
    index: int
    """Place in the array of its section."""
    name: str
    variable: CVariable

    @property
    def is_computed(self) -> bool:
        """Whether the unit computes it, so that it has no start value."""
        return self.section.kind == "COMPUTED"


def variables_of(plant: CPlant, source: str) -> tuple[FmuVariable, ...]:
    """Return all variables in the order of their references.

    Raises:
        InputError: Two would have one name; it names `source`.
    """
    found = tuple(
        FmuVariable(reference=reference, section=section, index=index, name=one.name, variable=one)
        for reference, (section, index, one) in enumerate(_listed(plant))
    )
    names = [one.name for one in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            f'{source}: the name "{twice[0]}" would stand twice in the unit, which has one list of inputs, outputs and '
            f"parameters, with NAME_slope for each input, NAME_start for each state, time and {LONGEST_STEP}; rename "
            "it in the model"
        )
    return found


def _listed(plant: CPlant) -> Iterator[tuple[Section, int, CVariable]]:
    yield TIMES, 0, CVariable(name="time", unit="s", meaning="time of the simulator")
    inputs, outputs = {one.name for one in plant.inputs}, {one.name for one in plant.outputs}
    for k, one in enumerate(plant.inputs):
        yield INPUTS, k, one
    for k, one in enumerate(plant.inputs):
        meaning = f"rate of {one.name} from a communication point to the next one; 0: it is held"
        unit = without_brackets(f"({one.unit})/s")
        yield SLOPES, k, CVariable(name=SLOPE.format(name=one.name), unit=unit, meaning=meaning)
    for k, one in enumerate(plant.outputs):
        yield OUTPUTS, k, one
    for k, one in enumerate(plant.states):
        name = f"state.{one.name}" if one.name in outputs | inputs else one.name
        yield STATES, k, CVariable(name=name, unit=one.unit, meaning=one.meaning or "state")
    for k, one in enumerate(plant.parameters):
        yield PARAMETERS, k, one
    for k, one in enumerate(plant.states):
        name = START.format(name=one.name)
        yield (
            STARTS,
            k,
            CVariable(name=name, unit=one.unit, value=one.value, meaning=f"{one.name} at the start"),
        )
    meaning = f"longest step of the integrator, {plant.method}"
    yield STEP, 0, CVariable(name=LONGEST_STEP, unit="s", value=plant.longest_step_s, meaning=meaning)


def tables(variables: tuple[FmuVariable, ...]) -> str:
    """Return `variables.h`: place, kind, name and start value of each variable."""

    def listed(texts: Iterator[str]) -> str:
        return ",\n    ".join(texts)

    places = (f"offsetof(plant, {one.section.field}) / sizeof(double) + {one.index}" for one in variables)
    return f"""\
/* Variables by their value references. */
enum {{ COMPUTED, INPUT, SLOPE, TUNABLE, START, STEP_LENGTH }};
#define VARIABLES {len(variables)}
#define TIME_REFERENCE {TIME}
static const unsigned short places[VARIABLES] = {{
    {listed(places)}
}};
static const unsigned char kinds[VARIABLES] = {{
    {listed(one.section.kind for one in variables)}
}};
static const char *const names[VARIABLES] = {{
    {listed(f'"{one.name}"' for one in variables)}
}};
static const double lows[VARIABLES] = {{
    {listed(_bound(one.variable.low, -NO_BOUND) for one in variables)}
}};
static const double highs[VARIABLES] = {{
    {listed(_bound(one.variable.high, NO_BOUND) for one in variables)}
}};
static const double starts[VARIABLES] = {{
    {listed(repr(0.0 if one.is_computed else float(one.variable.value)) for one in variables)}
}};
"""


def _bound(value: float | None, otherwise: float) -> str:
    return repr(otherwise if value is None else float(value))
