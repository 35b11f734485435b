"""Small measured cases on a device with friction or none, by the bundled simulation: seconds a diagnosis."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.api import diagnosing
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.screening.split import split_records
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset
from rtctl.measured.dataset import Dataset
from rtctl.wiring_models import build_simulation

FloatArray = NDArray[np.float64]
UNITS = {"drive": "V", "displacement": "mm"}
PERIOD_S = 2e-3
SAMPLES = 1500
NOISE_MM = 0.004
NOMINAL = {"damping": (8.0, "1/s"), "stiffness": (1.6e4, "1/s^2"), "drive_gain": (450.0, "mm/s^2/V")}
FRICTION = {"id": "friction.coulomb", "parameters": {"level": {"value": 450.0, "unit": "mm/s^2"}}}
MODEL = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 8.5, unit = "1/s" }
stiffness = { value = 1.58e4, unit = "1/s^2" }
drive_gain = { value = 430.0, unit = "mm/s^2/V" }
"""
MANIFEST = """
[dataset]
name = "bench"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "{drive_unit}"
{more}
[signals.{response}]
role = "output"
unit = "{unit}"
"""


def device(*mechanisms: dict[str, object], **more: tuple[float, str]) -> Simulation:
    """The nominal one with `mechanisms` and `more` nominal parameters."""
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in (NOMINAL | more).items()}
    tables = {"kind": "oscillator", "parameters": parameters, "mechanisms": mechanisms}
    return build_simulation(ModelFile.model_validate({"model": tables}), UNITS, "device")


def cause(identity: str, **values: tuple[float, str]) -> dict[str, object]:
    """Table of a mechanism of the device, its parameters as (value, unit)."""
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in values.items()}
    return {"id": identity, "parameters": parameters}


def noise_drive(seed: int, level: float = 6.0, samples: int = SAMPLES) -> FloatArray:
    """Band noise about the resonance [V]."""
    drive = np.convolve(np.random.default_rng(seed).standard_normal(samples + 16), np.hanning(16), "valid")[
        :samples
    ]
    return level * drive / drive.std()


def measured(
    plant: Simulation, drive: FloatArray, noise: float = NOISE_MM, hold: str = "linear"
) -> FloatArray:
    """Reading [mm] of a record that starts at rest."""
    values = np.array([parameter.value for parameter in plant.parameters])
    run = plant.predict(Stimulus(inputs={"drive": drive}, holds={"drive": hold}, period_s=PERIOD_S), values)
    rng = np.random.default_rng(abs(int(1e6 * drive[7])) % 2**31)
    return run.outputs["displacement"][0] + noise * rng.standard_normal(len(drive))


def write_records(
    folder: Path,
    records: list[tuple[FloatArray, FloatArray, str]],
    rate_hz: float,
    units: Mapping[str, str],
    more: str = "",
) -> Path:
    """dataset.toml of (drive, response, use), with `more` about the drive; the manifest's path.

    `units` of the drive and of the response, by signal, in this order.
    """
    drive, response = units
    manifest = MANIFEST.format(drive_unit=units[drive], more=more, response=response, unit=units[response])
    for k, (driven, read, use) in enumerate(records):
        np.savetxt(
            folder / f"r{k}.csv", np.column_stack((driven, read)), delimiter=",", header=f"{drive},{response}",
            comments="", fmt="%.9g",
        )  # fmt: skip
        manifest += f'[[records]]\nfile = "r{k}.csv"\nsample_rate_hz = {rate_hz}\nuse = "{use}"\n'
    (folder / "dataset.toml").write_text(manifest)
    return folder / "dataset.toml"


def write_case(folder: Path, records: list[tuple[FloatArray, FloatArray, str]], more: str = "") -> Path:
    """dataset.toml, with `more` about the drive, and model.toml of (drive, displacement, use); the manifest's path."""
    (folder / "model.toml").write_text(MODEL)
    return write_records(folder, records, 1.0 / PERIOD_S, UNITS, more)


def friction_case(folder: Path) -> Path:
    """Two records to fit, one to test, of the device with friction."""
    plant = device(FRICTION)
    uses = ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
    drives = [(noise_drive(seed, level), use) for seed, level, use in uses]
    return write_case(folder, [(drive, measured(plant, drive), use) for drive, use in drives])


def dataset_of(folder: Path, *records: tuple[FloatArray, FloatArray, str]) -> Dataset:
    """In memory as the program reads it."""
    return read_dataset(write_case(folder, list(records)))


def answer_to(
    folder: Path, records: list[tuple[FloatArray, FloatArray, str]], mechanisms: str = "friction.coulomb"
) -> dict[str, Any]:
    """diagnosis.json of these records."""
    return json_of(write_case(folder, records), folder / "model.toml", mechanisms)


def json_of(manifest: Path, model: Path, mechanisms: str | None = None) -> dict[str, Any]:
    """What diagnosis.json has, without a second for the pictures of the report."""
    answer = diagnosing.diagnose(manifest, model, mechanisms=mechanisms)
    found: dict[str, Any] = json.loads(json.dumps(answer.to_dict()))
    return found


def problem_of(data: Dataset) -> Problem:
    """Records to fit of an oscillator, as a search has them."""
    subject = subject_of("oscillator")
    records, _, _ = split_records(data, subject)
    return Problem(subject=subject, records=records, scales=estimate_scales(records), steps_per_period=64.0)


def fit_of(problem: Problem, *mechanisms: str) -> Hypothesis:
    """The nominal device with these mechanisms, fitted."""
    found = fit_hypothesis(problem, device().extended(mechanisms), mechanisms)
    assert found is not None
    return found
