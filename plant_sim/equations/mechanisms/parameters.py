"""Mechanisms of a parameter: it drifts with the time, or depends on an input or a state.

p -> p (1 + drift t + coefficient (x - reference) + ...)
"""

from __future__ import annotations

from plant_sim.equations.mechanisms.mechanism import PARAMETERS, EquationsMechanism, coefficient
from plant_sim.equations.mechanisms.sizes import Sizes
from plant_sim.equations.mechanisms.words import Names, counted, reference_of
from plant_sim.equations.system import Constant, System


def parameter_mechanisms(
    one: Constant, system: System, sizes: Sizes, names: Names, references: dict[str, str]
) -> list[EquationsMechanism]:
    """Return the drift of a parameter and its dependence on each input and state, also of one whose value is known.

    Args:
        one: The parameter.
        system: Its equations.
        sizes: Sizes of the courses.
        names: Names that are taken.
        references: Name of the value from which a course is counted, by course.
    """
    words = f"parameter {one.name} [{one.unit}]"
    drift = names.new(f"{one.name}_drift")
    drifting = EquationsMechanism(
        id=f"parameter.{one.name}.drift",
        statement=f"The {words} drifts by {{rate}} of itself from the start of each record.",
        parameters=(coefficient("rate", "1/s", "relative to the parameter", 1.0 / sizes.scales.duration),),
        family=PARAMETERS,
        names={"rate": drift},
        target=one.name,
        text=f"{drift}*t",
        slow=True,
    )
    return [drifting, _dependence(one, words, system, sizes, names, references)]


def _dependence(
    one: Constant, words: str, system: System, sizes: Sizes, names: Names, references: dict[str, str]
) -> EquationsMechanism:
    courses = {state.name: state.unit for state in system.states}
    courses |= {source.name: source.unit for source in system.inputs}
    parameters = tuple(
        coefficient(name, f"1/({unit})", f"relative change with {name}", 1.0 / sizes[name].rms, default=0.0)
        for name, unit in courses.items()
    )
    own = {name: names.new(f"{one.name}_by_{name}") for name in courses}
    starts = {state.name: (state.unit, reference_of(state)) for state in system.states}
    parts = " + ".join(f"{{{name}}} of itself with {name}" for name in courses)
    return EquationsMechanism(
        id=f"parameter.{one.name}.dependence",
        statement=f"The {words} is no constant: it changes by {parts}.",
        forms={
            name: f"The {words} is no constant: it changes by {{{name}}} of itself with {name}."
            for name in courses
        },
        parameters=parameters, family=PARAMETERS, names=own, target=one.name,
        text=" + ".join(f"{own[name]}*{counted(name, references)}" for name in courses),
        references={references[name]: starts[name] for name in courses if name in references},
    )  # fmt: skip
