"""Where a response folds, a model that misses the motion ends: sets start from the balance along the measured one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sweep_cases import CUBIC, DAMPING, GAIN, STIFFNESS, UP, Sweep, noisy, response, write_sweeps
from test_steady_state import model

from plant_sim.oscillator.model import simulation_of_data
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_for
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.proposals.regression import NO_REGRESSIONS, Regression, propose_by_regression
from rtctl.identification.oscillator.identify import select_usable_records
from rtctl.identification.scales import estimate_scales
from rtctl.identification.sweep_record import prepare_sweep
from rtctl.measured.reading import read_dataset

IDS = ("damping.nonlinear", "damping.quadratic", "sensor.saturation")
PLAN = ((UP, 0.08), (UP, 0.4), (UP[::-1], 0.4), (UP, 0.2))
"""Sweeps of which those of 0.4 V fold."""


def case(
    folder: Path, nonlinear: float, quadratic: float, cubic: float = CUBIC
) -> tuple[Problem, TestedHypothesis]:
    """Sweeps of a device with damping by z^2 z' and z' |z'|, beside a model without, of another `cubic` spring."""
    made = []
    for seed, (rows, drive) in enumerate(PLAN):
        amplitude = response(rows, drive, lambda z, v: nonlinear * z**2 * v + quadratic * np.abs(v) * v)
        made.append(Sweep(rows, drive, noisy(amplitude, 0.002, seed), "fit"))
    dataset = read_dataset(write_sweeps(folder, made))
    records = tuple(prepare_sweep(one) for one in select_usable_records(dataset))
    problem = Problem(
        subject=subject_for("oscillator", dataset), records=records, scales=estimate_scales(records),
        steps_per_period=64.0,
    )  # fmt: skip
    simulation = simulation_of_data(model(cubic), dataset.units, "model")
    nominal = fit_hypothesis(problem, simulation, (), iterations=0)
    assert nominal is not None
    return problem, run_residual_tests(nominal, problem, IDS)


def started(simulation: Simulation) -> dict[str, float]:
    return {one.name: one.value for one in simulation.parameters}


def test_one_cause_starts_at_its_size_from_a_model_that_folds_elsewhere(tmp_path: Path) -> None:
    problem, parent = case(tmp_path, 0.8 * DAMPING, 0.0, cubic=0.5 * CUBIC)
    found = propose_by_regression(parent, problem)
    assert found.singles[0].mechanisms == ("damping.nonlinear",)
    start = started(found.singles[0].simulation)
    assert start["damping.nonlinear.coefficient"] == pytest.approx(0.8 * DAMPING, rel=0.02)
    assert start["damping"] == pytest.approx(DAMPING, rel=0.02)
    assert start["stiffness"] == pytest.approx(STIFFNESS, rel=2e-4)
    assert start["stiffness_cubic"] == pytest.approx(CUBIC, rel=0.02)
    assert start["drive_gain"] == pytest.approx(GAIN, rel=0.01)


def test_what_exerts_a_force_is_judged_by_the_regression_alone(tmp_path: Path) -> None:
    problem, parent = case(tmp_path, 0.8 * DAMPING, 0.0)
    judged = propose_by_regression(parent, problem).judged
    assert judged == {"damping.nonlinear", "damping.quadratic"}  # what only a sensor does is no force


def test_two_causes_at_once(tmp_path: Path) -> None:
    problem, parent = case(tmp_path, 0.8 * DAMPING, 0.02)
    first, *_ = propose_by_regression(parent, problem).pairs
    assert set(first.mechanisms) == {"damping.nonlinear", "damping.quadratic"}
    start = started(first.simulation)
    assert start["damping.nonlinear.coefficient"] == pytest.approx(0.8 * DAMPING, rel=0.1)
    assert start["damping.quadratic.coefficient"] == pytest.approx(0.02, rel=0.1)


def test_rows_without_a_drive_tell_nothing(tmp_path: Path) -> None:
    problem, parent = case(tmp_path, 0.8 * DAMPING, 0.0)
    record = problem.records[0]
    silent = replace(record.stimulus, inputs={**record.stimulus.inputs, "drive": np.zeros(record.samples)})
    more = replace(problem, records=(*problem.records, replace(record, stimulus=silent)))
    driven = Regression(parent.hypothesis, problem, ()).solve()
    with_silent = Regression(parent.hypothesis, more, ()).solve()
    np.testing.assert_array_equal(with_silent.nominal, driven.nominal)


def test_none_where_nothing_is_missing(tmp_path: Path) -> None:
    problem, parent = case(tmp_path, 0.0, 0.0)
    assert propose_by_regression(parent, problem) == NO_REGRESSIONS
