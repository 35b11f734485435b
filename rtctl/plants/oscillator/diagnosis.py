"""An oscillator: forces of no name act where the drive does, phi(z, v, u, t) along the simulated motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.border.statistics import NORMAL_95
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.finite_differences import differentiate
from rtctl.diagnosis.problem.subject import (
    DifferenceSteps,
    FittedModel,
    FittedRecords,
    Force,
    Levels,
    MemoryForces,
    Reader,
    Records,
    Subject,
)
from rtctl.identification.noise.resonant_part import Resonance
from rtctl.identification.oscillator.response import describe_response
from rtctl.identification.scales import find_largest_displacement, find_longest_time
from rtctl.models.derived.oscillator import derive_oscillator
from rtctl.models.derived.quantity import Derived
from rtctl.models.oscillator import read_oscillator_model
from rtctl.models.provenance import write_checked_model
from rtctl.plants.oscillator.steady import by_steady_state

GENERIC: tuple[tuple[str, str, Callable[..., FloatArray]], ...] = (
    ("z^2", "displacement", lambda z, v, u, t: z**2),
    ("z^3", "displacement", lambda z, v, u, t: z**3),
    ("z^5", "displacement", lambda z, v, u, t: z**5),
    ("|z|", "displacement", lambda z, v, u, t: np.abs(z)),
    ("sign z", "displacement", lambda z, v, u, t: np.tanh(10.0 * z)),
    ("v |v|", "velocity", lambda z, v, u, t: v * np.abs(v)),
    ("v^3", "velocity", lambda z, v, u, t: v**3),
    ("v^2", "velocity", lambda z, v, u, t: v**2),
    ("sign v", "velocity_sign", lambda z, v, u, t: np.tanh(20.0 * v)),
    ("z^2 v", "amplitude", lambda z, v, u, t: z**2 * v),
    ("z v", "state", lambda z, v, u, t: z * v),
    ("v^2 z", "amplitude", lambda z, v, u, t: v**2 * z),
    ("1", "drive", lambda z, v, u, t: np.ones_like(z)),
    ("u^2", "drive", lambda z, v, u, t: u**2),
    ("u^3", "drive", lambda z, v, u, t: u**3),
    ("du", "drive_rate", lambda z, v, u, t: np.gradient(u)),
    ("u z", "drive", lambda z, v, u, t: u * z),
    ("u v", "drive", lambda z, v, u, t: u * v),
    ("t z", "time", lambda z, v, u, t: t * z),
    ("t v", "time", lambda z, v, u, t: t * v),
    ("t u", "time", lambda z, v, u, t: t * u),
    ("t", "time", lambda z, v, u, t: t),
)


LATE = (2.0, 4.0, 6.0, 9.0, 12.0, 16.0, 20.0, 24.0)
"""Radians of the motion's rate by which forces follow the displacement."""
RELAXING = (1.0 / 16.0, 1.0 / 4.0, 1.0, 4.0, 16.0)
"""Rates of springs that relax, over the motion's."""
PAST = (
    *(f"z, {late:g} rad late" for late in LATE),
    *(f"z, relaxing at {rate:g} rad/rad" for rate in RELAXING),
)


def force_sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
    """Return (forces, outputs, n) of record `index`, each as strong as the drive's own force."""

    def forces(z: FloatArray, v: FloatArray, u: FloatArray) -> list[FloatArray]:
        t = np.linspace(-1.0, 1.0, len(z))
        return [force(z, v, u, t) for _, _, force in GENERIC]

    return _pushed(hypothesis, problem, index, forces)


def memory_force_sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
    """(len(PAST), outputs, n) of record `index`: forces linear in the past of the displacement."""
    radians = problem.scales.rate * problem.records[index].period_s

    def forces(z: FloatArray, v: FloatArray, u: FloatArray) -> list[FloatArray]:
        at = np.arange(len(z), dtype=float)
        late = [np.interp(at - lag / radians, at, z) for lag in LATE]
        return [*late, *(_relaxed(z, rate * radians) for rate in RELAXING)]

    return _pushed(hypothesis, problem, index, forces)


def _relaxed(z: FloatArray, rate: float) -> FloatArray:
    """(n,) w' = z' - rate w from zero, time in samples; exact for straight lines between them."""
    from scipy.signal import lfilter

    kept = float(np.exp(-rate))
    made: FloatArray = lfilter([(1.0 - kept) / rate], [1.0, -kept], np.diff(z, prepend=z[0]))
    return made


def _pushed(
    hypothesis: FittedModel,
    problem: FittedRecords,
    index: int,
    forces: Callable[[FloatArray, FloatArray, FloatArray], Sequence[FloatArray]],
) -> FloatArray:
    """Return the effects (forces, outputs, n) of `forces` (displacement, velocity, drive, each over its size)."""
    record = problem.records[index]
    values = hypothesis.values_of(index)
    start = np.atleast_2d(hypothesis.start(index))
    plain = _quickly_held(record.stimulus)
    base = hypothesis.simulation.predict(plain, values, start, problem.steps_per_period)
    if (base.diverged_at >= 0).any():  # straight lines may be what a law with narrow steps does not bear
        plain = record.stimulus
        base = hypothesis.simulation.predict(plain, values, start, problem.steps_per_period)
    scales, u = problem.scales, record.stimulus.inputs["drive"]
    z = base.outputs["displacement"][0] / scales.displacement
    v = base.outputs["velocity"][0] / scales.velocity
    outputs = hypothesis.sensitivity.outputs
    made = forces(z, v, u / (scales.drive or 1.0))
    found = np.zeros((len(made), len(outputs), record.samples - record.first))
    for k, phi in enumerate(made):

        def moved(step: float, phi: FloatArray = phi) -> FloatArray:
            stimulus = replace(plain, inputs={"drive": u + step * (scales.drive or 1.0) * phi})
            run = hypothesis.simulation.predict(stimulus, values, start, problem.steps_per_period)
            return np.array([(run.outputs[n] - base.outputs[n])[0, record.first :] for n in outputs])

        found[k] = differentiate(moved, problem, outputs)
    return found


def _quickly_held(stimulus: Stimulus) -> Stimulus:
    """With straight lines in place of a band-limited drive: what a small force adds hardly depends on it."""
    if stimulus.holds.get("drive") != "band-limited":
        return stimulus
    return replace(stimulus, holds={**stimulus.holds, "drive": "linear"})


def extended_model(
    start: ModelFile, simulation: Simulation, estimates: Mapping[str, Mapping[str, Estimate]]
) -> ModelFile:
    """Return `start` with the estimated parameters and mechanisms; a parameter that was not fitted keeps its value."""

    def value(estimate: Estimate) -> Value:
        return Value(value=estimate.value, unit=estimate.unit, low=estimate.low, high=estimate.high)

    nominal = estimates[""]
    parameters = {
        name: value(nominal[name]) if name in nominal else given
        for name, given in start.model.parameters.items()
    }
    tables = {table.id: table for table in start.model.mechanisms}
    for mechanism in simulation.mechanisms:
        kept = tables[mechanism.id].parameters if mechanism.id in tables else {}
        values = kept | {name: value(estimate) for name, estimate in estimates[mechanism.id].items()}
        tables[mechanism.id] = MechanismTable(id=mechanism.id, parameters=values)
    return ModelFile(
        model=ModelTable(kind=start.kind, parameters=parameters, mechanisms=tuple(tables.values()))
    )


def _write(path: Path, model: ModelFile, provenance: dict[str, Any]) -> None:
    write_checked_model(path, model.model_copy(update={"provenance": provenance}))


def _relative_errors(model: ModelFile) -> dict[str, float]:
    """Return standard errors over values, from the intervals of the file, taken as 95 %."""
    found = {}
    for name, one in model.model.parameters.items():
        if one.low is not None and one.high is not None and one.value:
            found[name] = (one.high - one.low) / (2.0 * NORMAL_95 * abs(one.value))
    return found


def _from_comparable(simulation: Simulation) -> Simulation:
    return simulation


def _to_comparable(simulation: Simulation, records: Records) -> tuple[Simulation, Reader]:
    return simulation, dict


def _quarter_period(scales: Scales) -> float:
    return 0.5 * np.pi / scales.rate


def find_resonances(simulation: Simulation) -> tuple[Resonance, ...]:
    """Return the resonance of the linear part; none of a device that is not stable without its further springs."""
    values = {one.name: one.value for one in simulation.parameters}
    stiffness, damping = values["stiffness"], values["damping"]
    if not (stiffness > 0.0 and damping > 0.0):
        return ()
    rate = math.sqrt(stiffness)
    return (Resonance(rate / (2.0 * math.pi), damping / (2.0 * rate)),)


def _derive(
    model: ModelFile,
    estimates: Mapping[str, Mapping[str, Estimate]],
    units: Mapping[str, str],
    problem: FittedRecords,
) -> tuple[Derived, ...]:
    zero = estimates.get("sensor.offset", {}).get("offset")
    largest = find_largest_displacement(
        problem.records, problem.scales.rate, 0.0 if zero is None else zero.value
    )
    return derive_oscillator(estimates, units, largest, find_longest_time(problem.records))


OSCILLATOR = Subject(
    kind="oscillator",
    drive="drive",
    output="displacement",
    required_signal="displacement",
    clippable_outputs=("displacement",),
    spike_outputs=("displacement", "velocity"),
    size_is_variation=False,
    forces=tuple(Force(name, coordinate) for name, coordinate, _ in GENERIC),
    force_sensitivities=force_sensitivities,
    difference_steps=DifferenceSteps((1e-5, 1e-7, 1e-9), small=1e-3),
    memory_forces=MemoryForces(
        tuple(Force(name, "past") for name in PAST),
        memory_force_sensitivities,
        ("nonparametric.relaxations", "nonparametric.feedback"),
    ),
    nonparametric_alternatives=(
        "nonparametric.spring",
        "nonparametric.stop",
        "nonparametric.dissipation",
        "nonparametric.relaxations",
        "nonparametric.feedback",
    ),
    sensed_rms=lambda records: 1.0,
    lag_s=_quarter_period,
    slower_sampling=(2,),
    is_at_rest_undriven=False,
    growth_is_misfit=True,
    allowed_share=0.0,
    stated_misfit=lambda model, dataset: {},
    least_share_removed=0.9,
    steps_per_period=64.0,
    screening_samples=None,
    to_comparable=_to_comparable,
    from_comparable=_from_comparable,
    find_coarse_parts=lambda model, dataset: {},
    find_identified_parts=lambda model, dataset: {},
    refit_parts=None,
    session_corrections={},
    output_offsets={},
    offset_mechanism="sensor.offset",
    resonances=find_resonances,
    describe_response=describe_response,
    derive=_derive,
    levels={"displacement": Levels("step", "level")},
    read_model=read_oscillator_model,
    relative_errors=_relative_errors,
    extended_model=extended_model,
    write_model=_write,
)
BY_VELOCITY = replace(
    OSCILLATOR, output="velocity", required_signal="velocity", clippable_outputs=("velocity",),
    spike_outputs=("velocity",), levels={"velocity": Levels("step", "level")},
)  # fmt: skip
BY_ACCELERATION = replace(
    OSCILLATOR, output="acceleration", required_signal="acceleration", clippable_outputs=("acceleration",),
    spike_outputs=("acceleration",), levels={"acceleration": Levels("step", "level")},
)  # fmt: skip
IN_TIME = (OSCILLATOR, BY_VELOCITY, BY_ACCELERATION)
SUBJECTS = (*IN_TIME, *(by_steady_state(one) for one in IN_TIME))
"""The oscillator by what was measured of its motion, in time or by sweeps."""
