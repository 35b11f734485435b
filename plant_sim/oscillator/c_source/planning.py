"""The steps of an exported oscillator: those of its simulation of some records, or what its linear part needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_sim.oscillator.integration.steps import STEPS_PER_PERIOD, Plan
from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CRequest
from rtctl.border.simulation import Stimulus

SAMPLES_PER_PERIOD = 32.0
"""Communication points that are proposed in a period of the fastest motion."""
SLOWEST_S = 1.0
"""Communication step that is proposed for a model without stiffness [s]."""


class Steps(NamedTuple):
    """How an exported oscillator is integrated."""

    step_s: float
    """Proposed time between two communication points [s]."""
    longest_s: float
    """Longest step of the integrator [s]."""
    instant_s: float
    """Longest time between two instants that the sensor looks at [s]."""
    splitting: bool


def steps_for(
    simulation: OscillatorSimulation, acting: Sequence[OscillatorMechanism], source: str, request: CRequest
) -> Steps:
    """Return the steps. Raises InputError where no sensible step resolves the model; it names `source`."""
    values = np.array([[one.value for one in simulation.parameters]])
    equation = Equation.of(simulation.parameters, list(acting), values)
    try:
        if not request.stimuli:
            return _without_records(equation, acting, request.step_s)
        found = [_of_record(simulation, equation, acting, values, one, None) for one in request.stimuli]
        splitting = all(how.splitting for how, _ in found)
        if not splitting:  # one integrator for all records
            found = [
                _of_record(simulation, equation, acting, values, one, STEPS_PER_PERIOD)
                if how.splitting else (how, instants)
                for one, (how, instants) in zip(request.stimuli, found, strict=True)
            ]  # fmt: skip
        pairs = list(zip(request.stimuli, found, strict=True))
        finest = min(one.period_s / how.substeps for one, (how, _) in pairs)
        instant = min(one.period_s / instants for one, (_, instants) in pairs)
        return Steps(request.step_s or request.stimuli[0].period_s, finest, instant, splitting)
    except ValueError as error:
        raise InputError(f"{source}: {error}") from None


# 6 parameters because a record's steps follow from all of these
def _of_record(
    simulation: OscillatorSimulation,
    equation: Equation,
    acting: Sequence[OscillatorMechanism],
    values: FloatArray,
    stimulus: Stimulus,
    steps_per_period: float | None,
) -> tuple[Plan, int]:
    """Return the integrator's steps between two samples of a record, and the instants at which the sensor looks."""
    start = simulation.starting(stimulus, values[0])
    reach = max(stimulus.peak.get("displacement", 0.0), abs(float(start[0])), equation.rest())
    if "displacement" not in stimulus.peak:
        moved = simulation.predict(stimulus, values).outputs["displacement"]
        reach = max(reach, float(np.nanmax(np.abs(moved))))
    return simulation.steps_of(equation, list(acting), stimulus, reach, steps_per_period)


def _without_records(
    equation: Equation, acting: Sequence[OscillatorMechanism], step_s: float | None
) -> Steps:
    """Return the steps for motions within the wells, driven by one unit of the drive."""
    rate, _ = equation.rates(equation.rest(), 1.0)
    proposed = float(f"{2.0 * math.pi / (rate * SAMPLES_PER_PERIOD):.1e}") if rate > 0.0 else SLOWEST_S
    step_s = step_s or proposed
    hold = "" if any(one.acts_before_the_equation for one in acting) else "linear"
    how = equation.plan(step_s, equation.rest(), hold, None if hold else STEPS_PER_PERIOD, drive=1.0)
    if how.splitting and not equation.is_linear:  # kicks need the size of a motion that nobody has told
        how = equation.plan(step_s, equation.rest(), hold, STEPS_PER_PERIOD, drive=1.0)
    return Steps(step_s, step_s / how.substeps, step_s / how.substeps, how.splitting)
