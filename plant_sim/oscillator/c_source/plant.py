"""An oscillator's model file as a C plant: equation, mechanisms, the integrator and the step that its motion needs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from plant_sim.oscillator.c_source.equation import CEquation, c_equation
from plant_sim.oscillator.c_source.planning import Steps, steps_for
from plant_sim.oscillator.c_source.signals import line_size
from plant_sim.oscillator.c_source.traced import Traced
from plant_sim.oscillator.c_source.translation import EXTREMES
from plant_sim.oscillator.device_table import signal_units
from plant_sim.oscillator.equation.terms import TERMS
from plant_sim.oscillator.integration.turning_points import DEEPEST, STATE_SIZE
from plant_sim.oscillator.mechanism import OscillatorMechanism, Values
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CRequest, CVariable, steps_kept
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import FreeParameter

FOLDER = Path(__file__).parent
IN_PATH = frozenset(
    {
        "drive.delay", "input.gain_drift", "drive.offset", "drive.deadband", "drive.saturation", "drive.harmonics",
        "drive.lag", "actuator.backlash", "actuator.hysteresis",
        "mode.second", "sensor.highpass", "sensor.lag", "sensor.saturation", "sensor.offset", "sensor.hum",
        "sensor.drift", "sensor.quantisation",
    }
)  # fmt: skip
"""Mechanisms outside the equation that `path.c` has."""
REASONS = {
    "timing.skew": "the reading of a row at another instant is a matter of the recording, not of the plant",
    "sensor.crosstalk": "which drive a reading sees that is taken as it steps is a matter of the recording",
    "input.hold": "the simulator says how an input goes on between communication points",
}
"""Why mechanisms have no form in C."""
PROPAGATOR = 14
"""Numbers in a `propagator` of linear.c."""
REMEMBERED = 15
"""Numbers in a `motion` besides the mechanisms' states and two propagators."""


def oscillator_plant(model: ModelFile, source: str, request: CRequest) -> CPlant:
    """Return the model as a C plant, whose signals are in the units of the records, else of the model's drive gain.

    Raises:
        InputError: A part of the model has no form in C; it is named.
    """
    simulation = oscillator_simulation(model, request.units or signal_units(model, source), source)
    values = np.array([[one.value for one in simulation.parameters]])
    acting = [one for one in simulation.mechanisms if simulation.acts(one, values)]
    _check(simulation, acting, source)
    shown = [one for one in simulation.parameters if one.mechanism in {"", *(own.id for own in acting)}]
    traced = {one.name: Traced(one.value, c_name(one.name)) for one in shown}
    mechanisms = [
        (one, {p.name: traced[f"{one.id}.{p.name}"] for p in one.parameters})
        for one in sorted(acting, key=lambda one: one.id)
    ]
    try:
        equation = c_equation({one.name: traced[one.name] for one in shown if not one.mechanism}, mechanisms)
    except TypeError as error:
        raise InputError(f"{source}: {error}") from None
    steps = steps_for(simulation, acting, source, request)
    delay_s = sum(one.value for one in shown if one.mechanism == "drive.delay")
    kept = steps_kept(delay_s, steps.step_s, f"{source}: drive.delay")
    z, v, u = (simulation.units[name] for name in ("displacement", "velocity", "drive"))
    return CPlant(
        kind="oscillator",
        inputs=(CVariable(name="drive", unit=u),),
        outputs=(
            CVariable(name="displacement", unit=z, meaning="as the sensor reads it"),
            CVariable(name="velocity", unit=v),
        ),
        states=(CVariable(name="displacement", unit=z), CVariable(name="velocity", unit=v)),
        parameters=tuple(_variable(one) for one in shown),
        memory=REMEMBERED
        + 2 * PROPAGATOR
        + max(equation.own_states, 1)
        + (line_size(kept) if delay_s > 0.0 else 0)
        + (STATE_SIZE if "actuator.hysteresis" in {one.id for one in acting} else 0),
        step_s=steps.step_s,
        longest_step_s=steps.longest_s,
        method="Strang splitting, its linear part exact" if steps.splitting else "Runge-Kutta of order 4",
        source="\n".join(_source(shown, mechanisms, equation, steps, kept)),
        direct=((), ()),
        mechanisms=tuple(one.id for one in acting),
    )


def c_name(parameter: str) -> str:
    """Return the name in C of a parameter such as "friction.coulomb.level"."""
    return re.sub(r"\W", "_", parameter).upper()


def _check(simulation: OscillatorSimulation, acting: list[OscillatorMechanism], source: str) -> None:
    """Raise InputError for mechanisms that have no form in C."""
    lines = []
    for one in acting:
        outside = one.input is not None or one.drive is not None or one.sensor is not None
        if outside and one.id not in IN_PATH:
            lines.append(
                f"{source}: {one.id} has no form in C: {REASONS.get(one.id, 'it acts outside the equation')}"
            )
        elif one.sensor is not None and simulation.response != "displacement":
            lines.append(
                f"{source}: {one.id} has no form in C where the sensor reads the {simulation.response}: it needs what "
                "is yet to come"
            )
    if lines:
        raise InputError("\n".join(lines))


def _variable(one: FreeParameter) -> CVariable:
    return CVariable(
        name=one.name, unit=one.unit, value=one.value, meaning=one.declared.meaning,
        low=one.low if math.isfinite(one.low) else None, high=one.high if math.isfinite(one.high) else None,
    )  # fmt: skip


def _source(
    shown: list[FreeParameter],
    mechanisms: Sequence[tuple[OscillatorMechanism, Values]],
    equation: CEquation,
    steps: Steps,
    kept: int,
) -> Iterator[str]:
    """Yield the parts of the source."""
    yield "#include <math.h>\n#include <string.h>\n"
    for k, one in enumerate(shown):
        yield f"#define {c_name(one.name)} value[{k}] /* {one.declared.meaning} [{one.unit}] */"
    for mechanism, _ in mechanisms:
        yield f"#define HAS_{c_name(mechanism.id)}"
    yield f"#define ROWS {equation.rows}\n#define OWN_STATES {equation.own_states}"
    yield f"#define INSTANT {steps.instant_s!r} /* of the sensor [s] */"
    if equation.rubs:
        yield "#define RUBS"
    acting = {mechanism.id for mechanism, _ in mechanisms}
    yield _part("signals/paths.c")
    if "drive.delay" in acting:
        yield f"#define KEPT {kept}\n#define WITHIN {int(any(one.bends for one, _ in mechanisms))}"
        yield _part("signals/delay.c")
    if "actuator.hysteresis" in acting:
        yield f"#define DEEPEST {DEEPEST}"
        yield _part("turning_points.c")
    yield _part("propagator.c")
    if steps.splitting or "mode.second" in acting:
        yield _part("linear.c")
    yield _part("motion.c")
    forces = "" if steps.splitting else equation.forces  # a splitting has its own
    for name, text in EXTREMES.items():
        if f"{name}(" in forces:
            yield text
    yield equation.coefficients
    yield forces
    if "drive.saturation" in acting:
        yield _part("langevin.c")
    yield _part("path.c")
    if steps.splitting:
        places = {"GAIN": "gain", "DAMPING_TERM": "damping", "STIFFNESS_TERM": "stiffness", "CUBIC": "cubic"}
        places |= {"QUADRATIC": "quadratic", "QUINTIC": "quintic"}
        yield "".join(f"#define {word} {TERMS.index(term)}\n" for word, term in places.items())
    yield _part("splitting.c" if steps.splitting else "runge_kutta.c")
    yield _part("march.c")


def _part(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
