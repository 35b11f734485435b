"""Generic mechanisms of a functional mock-up unit, by id: of its inputs, its outputs, its tunable parameters.

What goes on inside a unit is not seen, so there are none of states.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from plant_sim.equations.mechanisms.mechanism import PARAMETERS, EquationsMechanism, coefficient
from plant_sim.equations.mechanisms.signals import signal_mechanisms
from plant_sim.equations.mechanisms.sizes import Sizes
from plant_sim.equations.system import Constant, System


def unit_mechanisms(
    system: System, units: Mapping[str, str], sizes: Sizes, tunable: Sequence[str]
) -> dict[str, EquationsMechanism]:
    """Return the mechanisms of a unit.

    Args:
        system: Its channels and parameters.
        units: Units of the data's signals by name; an output that was not measured has that of the unit.
        sizes: Sizes of all signals, in the data's units.
        tunable: Parameters that may change while the unit runs.
    """
    found = signal_mechanisms(system, units, sizes)
    for parameter in system.parameters:
        if parameter.name in tunable:
            found += _of_parameter(parameter, system, units, sizes)
    return {one.id: one for one in found}


def _of_parameter(
    one: Constant, system: System, units: Mapping[str, str], sizes: Sizes
) -> Iterator[EquationsMechanism]:
    """Yield the drift of a parameter, and its dependence on each input and output."""
    words = f"parameter {one.name} [{one.unit}]"
    yield EquationsMechanism(
        id=f"parameter.{one.name}.drift",
        statement=f"The {words} drifts by {{rate}} of itself from the start of each record.",
        parameters=(coefficient("rate", "1/s", "relative to the parameter", 1.0 / sizes.scales.duration),),
        family=PARAMETERS,
        target=one.name,
        slow=True,
    )
    courses = {one.name: units.get(one.name, one.unit) for one in system.inputs}
    courses |= {one.name: units.get(one.name, one.unit) for one in system.outputs}
    parts = " + ".join(f"{{{name}}} of itself with {name}" for name in courses)
    yield EquationsMechanism(
        id=f"parameter.{one.name}.dependence",
        statement=f"The {words} is no constant: it changes by {parts}.",
        forms={
            name: f"The {words} is no constant: it changes by {{{name}}} of itself with {name}."
            for name in courses
        },
        parameters=tuple(
            coefficient(
                name, f"1/({unit})", f"relative change with {name}", 1.0 / sizes[name].rms, default=0.0
            )
            for name, unit in courses.items()
        ),
        family=PARAMETERS,
        target=one.name,
    )
