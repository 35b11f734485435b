"""Equations of a user as the diagnosis sees them: signals of the data, forces on every rate, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.file import EquationsFile
from rtctl.border.mechanisms import Scales
from rtctl.border.model_file import Value
from rtctl.border.simulation import Prediction, Simulation, Stimulus
from rtctl.border.statistics import NORMAL_95
from rtctl.border.units.quantities import check, read_toml
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.finite_differences import differentiate
from rtctl.diagnosis.problem.subject import (
    DifferenceSteps,
    FittedModel,
    FittedRecords,
    Force,
    Reader,
    Records,
    Subject,
)
from rtctl.identification.equations.structure import undetermined_parameters
from rtctl.identification.scales import estimate_scales
from rtctl.measured.dataset import Dataset
from rtctl.models.provenance import write_checked_model
from rtctl.plants.equations.starts import with_common_start
from rtctl.plants.equations.undetermined import describe_held

Shape = Callable[[FloatArray], FloatArray]
ALONG: tuple[tuple[str, Shape], ...] = (
    ("{}^2", lambda x: x**2),
    ("{}^3", lambda x: x**3),
    ("|{}|", np.abs),
    ("sign {}", lambda x: np.tanh(20.0 * x)),
    ("d{}", lambda x: unit_course(np.gradient(x))),
)
"""Forces along a course x, over its size."""


class EquationsModel(Simulation, Protocol):
    """A simulation of equations, as the diagnosis needs it beyond other simulations."""

    def sized(self, stimuli: Any, measured: Any, scales: Scales) -> EquationsModel:
        """Return the same with the sizes of its courses along its own runs."""
        ...

    def holding(self, names: tuple[str, ...]) -> EquationsModel:
        """Return the same with these parameters fixed at their values."""
        ...

    def pushed(
        self, stimulus: Stimulus, values: FloatArray, initial: FloatArray, pushes: FloatArray,
        steps_per_period: float | None = None,
    ) -> Prediction:  # fmt: skip
        """Return the prediction with `pushes` (states, samples) added to the rates."""
        ...


def equations_subject(simulation: Any, dataset: Dataset) -> Subject:
    """Return the subject of a model: its first input and first measured output are the drive and the reading."""
    inputs = tuple(one.name for one in simulation.system.inputs)
    system = simulation.system
    states = tuple(one.name for one in system.states)
    moving = tuple(name for name, switched in zip(states, system.discrete, strict=True) if not switched)
    outputs = tuple(one.name for one in simulation.system.outputs if one.name in dataset.units)
    forces = _forces(moving, inputs)

    def sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
        return _push(hypothesis, problem, index, states, moving, inputs)

    return Subject(
        kind="equations",
        drive=inputs[0] if inputs else "",
        output=outputs[0],
        required_signal=outputs[0],
        clippable_outputs=outputs,
        spike_outputs=outputs,
        size_is_variation=True,
        forces=forces,
        force_sensitivities=sensitivities,
        memory_forces=None,
        difference_steps=DifferenceSteps((1e-5, 1e-7, 1e-9), small=1e-3),
        nonparametric_alternatives=(),
        sensed_rms=lambda records: 1.0,
        lag_s=lambda scales: float(0.5 * np.pi / scales.rate),
        slower_sampling=(),
        is_at_rest_undriven=False,
        growth_is_misfit=False,
        allowed_share=0.0,
        stated_misfit=lambda model, dataset: {},
        least_share_removed=0.6,
        steps_per_period=64.0,
        screening_samples=None,
        reads_initial_states=False,
        noise_starts_white=True,
        state_units={one.name: one.unit for one in system.states},
        takes_scenarios=len(inputs) == 1,
        to_comparable=_to_comparable(outputs[0], inputs[0] if inputs else ""),
        from_comparable=lambda simulation: simulation,
        find_coarse_parts=lambda model, dataset: {},
        find_identified_parts=lambda model, dataset: {},
        refit_parts=None,
        session_corrections={},
        output_offsets={},
        offset_mechanism=f"output.{outputs[0]}.offset",
        levels={},
        describe_screened=describe_held,
        read_model=lambda path: check(EquationsFile, read_toml(path), str(path)),
        relative_errors=_relative_errors,
        extended_model=extended_model,
        with_starts=with_common_start,
        write_model=_write,
    )


def _to_comparable(output: str, drive: str) -> Callable[[Simulation, Records], tuple[Simulation, Reader]]:
    """Return what gives a simulation the sizes of the records' courses."""

    def sized(simulation: Any, records: Records) -> tuple[Simulation, Reader]:
        scales = estimate_scales(records, output, drive)
        stimuli = [record.stimulus for record in records]
        found = simulation.sized(stimuli, [record.measured for record in records], scales)
        return found.holding(undetermined_parameters(found, records, scales)), dict

    return sized


def _forces(states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Force, ...]:
    found = []
    for state in states:
        found += [Force(f"1 on {state}", "constant"), Force(f"t on {state}", "time")]
        found += [
            Force(f"{name.format(course)} on {state}", course)
            for course in (*states, *inputs)
            for name, _ in ALONG
        ]
    return tuple(found)


def _push(
    hypothesis: FittedModel, problem: FittedRecords, index: int, states: tuple[str, ...], moving: tuple[str, ...],
    inputs: tuple[str, ...],
) -> FloatArray:  # fmt: skip
    """Return what each force does to the outputs of a record (forces, outputs, n), as strong as the state's rate."""
    record, simulation = problem.records[index], hypothesis.simulation
    values, start = hypothesis.values_of(index), hypothesis.start(index)
    outputs = hypothesis.sensitivity.outputs
    idle = np.zeros((len(states), record.samples))

    def run(pushes: FloatArray) -> FloatArray:
        made = simulation.pushed(record.stimulus, values, start, pushes, problem.steps_per_period)  # type: ignore[attr-defined]
        return np.array([made.outputs[name][0] for name in (*outputs, *moving)])

    base = run(idle)
    courses = [*base[len(outputs) :], *(record.stimulus.inputs[name] for name in inputs)]
    along = [unit_course(course - course.mean()) for course in courses]
    shapes = [np.ones(record.samples), np.linspace(-1.0, 1.0, record.samples)]
    shapes += [shape(course) for course in along for _, shape in ALONG]
    found = []
    for place, name in enumerate(moving):
        k, course = states.index(name), base[len(outputs) + place]
        rate = float(np.std(np.gradient(course, record.period_s))) or 1.0
        for phi in shapes:

            def moved(step: float, k: int = k, phi: FloatArray = phi, rate: float = rate) -> FloatArray:
                pushes = idle.copy()
                pushes[k] = step * rate * phi
                made: FloatArray = (run(pushes) - base)[: len(outputs), record.first :]
                return made

            derivative = differentiate(moved, problem, outputs)
            found.append(np.broadcast_to(derivative, (len(outputs), record.samples - record.first)))
    return np.array(found)


def unit_course(x: FloatArray) -> FloatArray:
    """Return a course over its RMS."""
    return x / (float(np.sqrt(np.mean(x**2))) or 1.0)


def _relative_errors(model: EquationsFile) -> dict[str, float]:
    """Return standard error over value of each parameter whose file states one."""
    return {
        name: one.standard_error / abs(one.value)
        for name, one in model.model.parameters.items()
        if one.standard_error is not None and one.value
    }


def extended_model(
    start: EquationsFile, simulation: Simulation, estimates: Mapping[str, Mapping[str, Estimate]]
) -> EquationsFile:
    """Return `start` with the estimated parameters and mechanisms; what was not fitted keeps its value."""

    def value(estimate: Estimate, old: Value | None = None) -> Value:
        spread = 0.5 * (estimate.high - estimate.low) / NORMAL_95
        known = {"standard_error": spread} if np.isfinite(spread) and spread > 0.0 else {}
        bounds = {} if old is None else {"low": old.low, "high": old.high, "fixed": old.fixed}
        return Value(value=estimate.value, unit=estimate.unit, **bounds, **known)

    nominal = estimates[""]
    parameters = {
        name: value(nominal[name], given) if name in nominal else given
        for name, given in start.model.parameters.items()
    }
    tables = {
        mechanism.id: {name: value(estimate) for name, estimate in estimates[mechanism.id].items()}
        for mechanism in simulation.mechanisms
    }
    model = start.model.model_copy(update={"parameters": parameters})
    content: EquationsFile = simulation.written(start.model_copy(update={"model": model}), tables)  # type: ignore[attr-defined]
    return content


def _write(path: Path, model: EquationsFile, provenance: dict[str, Any]) -> None:
    write_checked_model(path, model.model_copy(update={"provenance": provenance}))
