"""Dry friction makes valleys of the initial state: other starts are tried for each record, and taken where they fit."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import FRICTION, NOISE_MM, PERIOD_S, device, measured, noise_drive
from vo2_model_cases import predict, simulation, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.initial_states import improve_initial_states
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

SILENT = 300
"""Samples before the drive sets in: the device rests where friction holds it."""


def at_the_true_values(starts: list[list[float]]) -> tuple[Problem, Hypothesis]:
    """Two records of a device with friction that began at rest at zero, and its own model from other starts."""
    records = []
    for seed in range(len(starts)):
        drive = noise_drive(seed + 1)
        drive[:SILENT] = 0.0
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        reading = measured(device(FRICTION), drive)
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=tuple(records),
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    found = fit_hypothesis(problem, device(FRICTION), ("friction.coulomb",), np.array(starts), 0)
    assert found is not None
    return problem, found


def test_a_record_that_a_wrong_start_leaves_elsewhere_begins_where_it_rested() -> None:
    problem, astray = at_the_true_values([[0.025, 0.0], [0.0, 0.0]])
    found = improve_initial_states(problem, astray)
    samples = sum(record.samples for record in problem.records)
    noise = 0.5 * samples * (NOISE_MM / problem.size("displacement")) ** 2
    assert astray.cost > 1.5 * noise
    assert found.cost == pytest.approx(noise, rel=0.1)
    assert abs(found.starts[0, 0]) < 0.01
    np.testing.assert_array_equal(found.values, astray.values)


def test_starts_that_are_right_stay() -> None:
    problem, right = at_the_true_values([[0.0, 0.0], [0.0, 0.0]])
    assert improve_initial_states(problem, right) is right


def test_where_no_step_resolves_another_start_it_is_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, astray = at_the_true_values([[0.025, 0.0], [0.0, 0.0]])

    def refused(*of: object) -> object:
        raise ValueError("would need 1e9 steps")

    monkeypatch.setattr(type(astray.simulation), "predict", refused)
    assert improve_initial_states(problem, astray) is astray


def test_a_model_without_states_is_as_it_is() -> None:
    stimulus = Stimulus(inputs={"current": telegraph(300, 1)}, holds={"current": "zero"}, period_s=1e-3)
    resistance, deflection = predict(simulation(), stimulus)
    records = (
        FitRecord(name="r", stimulus=stimulus, measured={"resistance": resistance, "deflection": deflection}),
    )
    problem = Problem(
        subject=subject_of("vo2"), records=records, scales=estimate_scales(records, "deflection", "current")
    )
    found = fit_hypothesis(problem, simulation(), (), iterations=0)
    assert found is not None
    assert improve_initial_states(problem, found) is found
