"""A functional mock-up unit as the diagnosis sees it: signals of the data, further drives on its inputs, files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.fmu_file import FmuFile
from rtctl.border.units.quantities import check, read_toml
from rtctl.diagnosis.problem.finite_differences import differentiate
from rtctl.diagnosis.problem.subject import FittedModel, FittedRecords, Force, Subject
from rtctl.measured.dataset import Dataset
from rtctl.plants.equations.diagnosis import ALONG, equations_subject, unit_course
from rtctl.plants.fmu.writing import write_fmu_model


def fmu_subject(simulation: Any, dataset: Dataset) -> Subject:
    """Return the subject of a unit: as that of equations, but what is tested for acts on its inputs."""
    inputs = tuple(one.name for one in simulation.system.inputs)
    outputs = tuple(name for name in simulation.outputs if name in dataset.units)
    forces = []
    for source in inputs:
        forces += [Force(f"1 on {source}", "constant"), Force(f"t on {source}", "time")]
        forces += [
            Force(f"{name.format(course)} on {source}", course)
            for course in (*outputs, *inputs)
            for name, _ in ALONG
        ]

    def sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
        return _push(hypothesis, problem, index, inputs, outputs)

    return replace(
        equations_subject(simulation, dataset),
        kind="fmu",
        forces=tuple(forces),
        force_sensitivities=sensitivities,
        takes_scenarios=False,
        read_model=lambda path: check(FmuFile, read_toml(path), str(path)),
        write_model=_write,
    )


def _push(
    hypothesis: FittedModel,
    problem: FittedRecords,
    index: int,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
) -> FloatArray:
    """Return what each further drive does to the outputs of a record (forces, outputs, n), as large as the input."""
    record, simulation = problem.records[index], hypothesis.simulation
    values, start = hypothesis.values_of(index), hypothesis.start(index)
    seen = hypothesis.sensitivity.outputs

    def run(name: str, push: FloatArray) -> dict[str, FloatArray]:
        moved = {**record.stimulus.inputs, name: record.stimulus.inputs[name] + push}
        stimulus = replace(record.stimulus, inputs=moved)
        made = simulation.predict(stimulus, values[None], start[None], problem.steps_per_period)
        return {one: made.outputs[one][0] for one in dict.fromkeys((*seen, *outputs))}

    base = run(inputs[0], np.zeros(record.samples))
    courses = [*(base[name] for name in outputs), *(record.stimulus.inputs[name] for name in inputs)]
    along = [unit_course(course - course.mean()) for course in courses]
    shapes = [np.ones(record.samples), np.linspace(-1.0, 1.0, record.samples)]
    shapes += [shape(course) for course in along for _, shape in ALONG]
    found = []
    for source in inputs:
        size = float(np.std(record.stimulus.inputs[source])) or 1.0
        for phi in shapes:

            def moved(
                step: float, source: str = source, phi: FloatArray = phi, size: float = size
            ) -> FloatArray:
                there = run(source, step * size * phi)
                return np.array([there[name] - base[name] for name in seen])[:, record.first :]

            derivative = differentiate(moved, problem, seen)
            found.append(np.broadcast_to(derivative, (len(seen), record.samples - record.first)))
    return np.array(found)


def _write(path: Path, model: FmuFile, provenance: dict[str, Any]) -> None:
    write_fmu_model(path, model.model_copy(update={"provenance": provenance}))
