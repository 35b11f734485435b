"""A model of one's own equations as a C plant: its laws, its integrator, the step that its fastest part needs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from plant_sim.equations.c_source.laws import laws, numbers
from plant_sim.equations.c_source.planning import steps_for
from plant_sim.equations.c_source.signals import REASONS, Signals
from plant_sim.equations.exported.extended import Outside, parted_system
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.language.tree import written
from plant_sim.equations.mechanisms.courses import Acting
from plant_sim.equations.system import System
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CRequest, CVariable

FOLDER = Path(__file__).parent


def equations_plant(model: EquationsFile, source: str, request: CRequest) -> CPlant:
    """Return the model as a C plant.

    Args:
        model: The model; inputs and outputs stay in its own units.
        source: Its file, for messages.
        request: The communication step, within which what decays fast is integrated by implicit steps; the records
            whose simulation is to be resolved.

    Raises:
        InputError: A part of the model has no form in C; it is named.
    """
    system, outside = parted_system(model, source)
    _check(outside, source)
    acting = [Acting(one.mechanism, one.values) for one in outside if one.is_input]
    how, step_s = steps_for(model, system, source, request, acting)
    signals = Signals(source, system, outside, step_s, len(system.parameters))
    return CPlant(
        kind="equations",
        inputs=tuple(CVariable(name=one.name, unit=one.unit) for one in system.inputs),
        outputs=tuple(CVariable(name=one.name, unit=one.unit) for one in system.outputs),
        states=tuple(
            CVariable(name=one.name, unit=one.unit, value=one.initial / one.factor) for one in system.states
        ),
        parameters=tuple(
            CVariable(
                name=one.name, unit=one.unit, value=one.value,
                low=one.low if np.isfinite(one.low) else None, high=one.high if np.isfinite(one.high) else None,
            )
            for one in system.parameters
        )
        + signals.parameters,
        memory=len(system.states) + len(system.events) + signals.memory,
        step_s=step_s,
        longest_step_s=step_s / how.substeps,
        method="linearly implicit Euler, extrapolated to order 4" if how.implicit else "Runge-Kutta of order 4",
        source="\n".join(_source(system, how, signals)),
        direct=tuple(system.direct(one) for one in system.outputs),
        mechanisms=tuple(one.id for one in model.model.mechanisms),
    )  # fmt: skip


def _check(outside: tuple[Outside, ...], source: str) -> None:
    """Raise InputError for mechanisms that have no form in C."""
    lines = [
        f"{source}: {one.id} has no form in C: {REASONS[one.law]}" for one in outside if one.law in REASONS
    ]
    if lines:
        raise InputError("\n".join(lines))


def _source(system: System, how: Plan, signals: Signals) -> Iterator[str]:
    """Yield the parts of the source."""
    yield "#include <math.h>\n#include <string.h>\n"
    yield "\n".join(_comment(system))
    yield numbers("input_factors", (one.factor for one in system.inputs))
    yield numbers(
        "parameter_factors", [*(one.factor for one in system.parameters), *(1.0 for _ in signals.parameters)]
    )
    yield numbers("state_factors", (one.factor for one in system.states))
    yield numbers("output_factors", (one.factor for one in system.outputs))
    yield numbers("low", (one.low for one in system.states))
    yield numbers("high", (one.high for one in system.states))
    if system.events:
        yield f"#define EVENTS {len(system.events)}"
        yield numbers("directions", (one.direction for one in system.events))
    limited = how.implicit or bool(system.events) or signals.filters > 0
    yield laws(system, limited=limited, plain=not how.implicit)
    parts = ["step.c"]
    if how.implicit or system.events:
        parts.append("share.c")
    if how.implicit:
        parts.append("implicit.c")
    else:
        parts += ["explicit.c", *(["part_explicit.c"] if system.events else [])]
    if system.events:
        parts.append("events.c")
    for part in parts:
        yield (FOLDER / part).read_text()
    yield _STEPS[how.implicit, bool(system.events)]
    yield from signals.source()
    yield (FOLDER / "march.c").read_text()


_STEPS = {
    (False, False): "static void one_step(double *x, const step *s) { runge_kutta(x, s); }\n",
    (True, False): (
        "static void one_step(double *x, const step *s) { part_of_step(x, s, 0.0, 1.0); within(x); }\n"
    ),
    (False, True): """\
/* One step; where an expression is no longer on its side, the step is gone through again with its events. */
static int carry_on(plant *m, double *x, const step *s)
{
    double past[STATES], g[EVENTS], *side = m->memory + STATES;
    memcpy(past, x, sizeof past);
    runge_kutta(x, s);
    guards(x, s->u[2], s->t + s->h, s->p, g);
    for (int e = 0; e < EVENTS; e++) {
        if (side[e] * g[e] <= 0.0) {
            memcpy(x, past, sizeof past);
            return carry(side, x, s);
        }
    }
    return 1;
}
""",
    (
        True,
        True,
    ): "static int carry_on(plant *m, double *x, const step *s) { return carry(m->memory + STATES, x, s); }\n",
}
"""The step of each method (implicit, with events)."""


def _comment(system: System) -> Iterator[str]:
    """Yield the equations as a comment."""
    yield "/* Equations, all numbers in SI base units:"
    for k, parameter in enumerate(system.parameters):
        yield f"   p[{k}]  {parameter.name} [{parameter.unit}] times {parameter.factor:.17g}"
    for name, tree in system.terms.items():
        yield f"   {name} = {written(tree)}"
    for k, state in enumerate(system.states):
        yield f"   d {state.name} / dt = {written(state.rate)}     (x[{k}] [{state.unit}])"
    for k, output in enumerate(system.outputs):
        yield f"   {output.name} = {written(output.value)}     (output {k} [{output.unit}])"
    for event in system.events:
        sets = ", ".join(f"{name} := {written(tree)}" for name, tree in event.sets.items())
        yield f"   when {written(event.when)} passes zero: {sets}"
    yield "*/"
