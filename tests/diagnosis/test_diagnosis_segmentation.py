"""A body without a spring is judged within short stretches: its free run never forgets how it began."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from diagnosis_cases import PERIOD_S, UNITS, device, friction_case
from numpy.typing import NDArray

from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.nominal_fit.segmentation import cut_strokes, drifts
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.screening.split import split_records
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset
from rtctl.wiring_models import build_simulation

FloatArray = NDArray[np.float64]


def carriage(**more: float) -> Simulation:
    """A mass with viscous damping, and `level` [mm/s^2] of dry friction, `offset` [V] of the drive."""
    parameters = {
        "damping": {"value": 2.0, "unit": "1/s"},
        "stiffness": {"value": 0.0, "unit": "1/s^2", "fixed": True},
        "drive_gain": {"value": 10.0, "unit": "mm/s^2/V"},
    }
    tables = [
        {"id": "friction.coulomb", "parameters": {"level": {"value": more["level"], "unit": "mm/s^2"}}},
        {"id": "drive.offset", "parameters": {"offset": {"value": more["offset"], "unit": "V"}}},
    ] if more else []  # fmt: skip
    return build_simulation(
        ModelFile.model_validate(
            {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": tables}}
        ),
        UNITS,
        "carriage",
    )


def strokes(plant: Simulation, samples: int = 6000) -> Problem:
    """One record of the carriage sent to and fro, ever faster."""
    t = PERIOD_S * np.arange(samples)
    drive = 40.0 * np.sign(np.sin(2.0 * np.pi * (0.3 + 0.02 * t) * t)) * (1.0 + 0.05 * t)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "zero"}, period_s=PERIOD_S)
    run = plant.predict(stimulus, np.array([one.value for one in plant.parameters]))
    reading = run.outputs["displacement"][0] + 1e-3 * np.random.default_rng(1).standard_normal(samples)
    record = FitRecord(name="strokes", stimulus=stimulus, measured={"displacement": reading})
    return data_of((record,))


def data_of(records: tuple[FitRecord, ...]) -> Problem:
    return Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )


def nominal_of(problem: Problem, simulation: Simulation) -> Hypothesis:
    found = fit_from_starts(problem, simulation, ())
    assert found is not None
    return found


def test_a_mass_that_drifts_away_remembers_and_its_stretches_lose_no_sample() -> None:
    problem = strokes(carriage(level=120.0, offset=3.0))
    nominal = nominal_of(problem, carriage())
    assert drifts(problem, nominal)
    short = cut_strokes(problem, nominal)
    assert len(short.records) > 4
    whole = problem.records[0].measured["displacement"]
    joined = np.concatenate([piece.measured["displacement"][:-1] for piece in short.records])
    np.testing.assert_array_equal(joined, whole[: len(joined)])
    assert len(joined) == len(whole) - 1
    assert nominal_of(short, carriage()).cost < 0.2 * nominal.cost  # no drift within a stretch


def test_a_spring_forgets_and_a_good_model_needs_no_stretches(tmp_path: Path) -> None:
    records, _, _ = split_records(read_dataset(friction_case(tmp_path)), subject_of("oscillator"))
    problem = data_of(records)
    assert not drifts(problem, nominal_of(problem, device()))
    free = strokes(carriage(level=1e-9, offset=1e-9))
    assert not drifts(free, nominal_of(free, carriage()))


def test_a_spring_that_rings_through_the_record_is_no_drift() -> None:
    """Q of 200, of which a third of the first swing is left at the end, and a sensor that is far off."""
    tables = {"damping": (0.2, "1/s"), "stiffness": (1600.0, "1/s^2"), "drive_gain": (450.0, "mm/s^2/V")}
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in tables.items()}
    ringing = build_simulation(
        ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}}),
        UNITS,
        "ringing",
    )
    problem = strokes(ringing)
    record = problem.records[0]
    reading = record.measured["displacement"]
    problem = data_of((replace(record, measured={"displacement": reading + 0.6 * reading.std()}),))
    nominal = nominal_of(problem, ringing)
    assert relative_misfit(problem, nominal) > NominalFitThresholds().close_misfit
    assert not drifts(problem, nominal)


def test_very_many_stretches_are_thinned_evenly() -> None:
    problem = strokes(carriage(level=120.0, offset=3.0))
    many = replace(problem, records=problem.records * 60)
    short = cut_strokes(many, nominal_of(problem, carriage()))
    assert len(short.records) == NominalFitThresholds().max_stroke_segments
