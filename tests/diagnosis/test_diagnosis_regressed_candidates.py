"""Where the nominal model misses the motion, sets start from a regression on the measured one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, measured, noise_drive

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.directions import Direction
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.proposals.regression import NO_REGRESSIONS, Regression, propose_by_regression
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.weak_form import sample_motion
from rtctl.identification.scales import estimate_scales

IDS = ("stop.two_sided", "stiffness.quintic", "friction.coulomb", "damping.quadratic", "sensor.lag")
STOPS = {
    "id": "stop.two_sided",
    "parameters": {
        "stiffness": {"value": 4e4, "unit": "1/s^2"},
        "lower": {"value": -1.0, "unit": "mm"},
        "upper": {"value": 1.0, "unit": "mm"},
    },
}
FRICTION = {"id": "friction.coulomb", "parameters": {"level": {"value": 600.0, "unit": "mm/s^2"}}}


def case(model: Simulation, *mechanisms: dict[str, object]) -> tuple[Problem, TestedHypothesis]:
    """`model`, not fitted, beside two records of a device that has `mechanisms`."""
    records = []
    for seed in (1, 2):
        drive = noise_drive(seed, 15.0)
        z = measured(device(*mechanisms), drive, noise=1e-3)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": z}))
    found = tuple(records)
    problem = Problem(
        subject=subject_of("oscillator"), records=found, scales=estimate_scales(found), steps_per_period=64.0
    )
    nominal = fit_hypothesis(problem, model, (), iterations=0)
    assert nominal is not None
    return problem, run_residual_tests(nominal, problem, IDS)


def started(values: Simulation) -> dict[str, float]:
    return {one.name: one.value for one in values.parameters}


def test_stops_that_a_cubic_spring_stands_in_for() -> None:
    """The linear step from the cubic spring's motion knows nothing of them."""
    model = device(stiffness=(1.0e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS)
    first, *_ = propose_by_regression(parent, problem).singles
    assert first.mechanisms == ("stop.two_sided",)
    start = started(first.simulation)
    assert start["stiffness"] == pytest.approx(1.6e4, rel=0.03)
    assert start["drive_gain"] == pytest.approx(450.0, rel=0.03)
    assert start["stop.two_sided.stiffness"] == pytest.approx(4e4, rel=0.1)
    assert start["stop.two_sided.upper"] == pytest.approx(1.0, rel=0.03)


def test_two_at_once() -> None:
    model = device(stiffness=(0.9e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS, FRICTION)
    pairs = propose_by_regression(parent, problem).pairs
    assert set(pairs[0].mechanisms) == {"stop.two_sided", "friction.coulomb"}
    assert started(pairs[0].simulation)["friction.coulomb.level"] == pytest.approx(600.0, rel=0.03)


def test_none_where_the_model_follows_the_motion_or_nothing_is_missing() -> None:
    for model in (device(), device(stiffness=(1.0e4, "1/s^2"))):
        problem, parent = case(model)
        assert propose_by_regression(parent, problem) == NO_REGRESSIONS


def test_starts_are_the_measured_ones() -> None:
    model = device(stiffness=(1.0e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS)
    first, *_ = propose_by_regression(parent, problem).singles
    shown: FloatArray = np.array([record.measured["displacement"][0] for record in problem.records])
    np.testing.assert_allclose(first.starts[:, 0], shown, atol=0.02)


def test_those_of_a_record_whose_first_samples_are_not_scored_stay() -> None:
    model = device(stiffness=(1.0e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS)
    late = tuple(replace(one, first=100) for one in problem.records)
    first, *_ = propose_by_regression(parent, replace(problem, records=late)).singles
    np.testing.assert_array_equal(first.starts[:, :2], parent.hypothesis.starts[:, :2])


def test_a_gain_that_no_drive_shows_stays() -> None:
    model = device(stiffness=(1.0e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS)
    silent = tuple(
        replace(one, stimulus=replace(one.stimulus, inputs={"drive": np.zeros(one.samples)}))
        for one in problem.records
    )
    solved = Regression(parent.hypothesis, replace(problem, records=silent), ()).solve()
    gain = [one.name for one in parent.hypothesis.simulation.parameters].index("drive_gain")
    assert solved.nominal[gain] == 0.0
    assert np.isfinite(solved.nominal).all()


def test_a_change_of_the_drive_acts_by_the_gain_that_is_solved_for() -> None:
    bent = {"id": "drive.harmonics", "parameters": {"second": {"value": 0.03, "unit": "1/V"}}}
    problem, parent = case(device(drive_gain=(200.0, "mm/s^2/V")), bent)
    along = Direction("drive.harmonics", "second", "", {}, 0.01)
    solved = Regression(parent.hypothesis, problem, [along]).solve((0,))
    assert solved.steps[0] * along.scale == pytest.approx(0.03, rel=0.03)


def test_a_force_lacks_the_slow_part_that_an_integrated_motion_lacks() -> None:
    """A drift of the drive's own, which no integrated velocity shows, beside a spring."""
    quintic = {
        "id": "stiffness.quintic",
        "parameters": {"coefficient": {"value": 900.0, "unit": "1/(mm^4*s^2)"}},
    }
    problem, parent = case(device(), quintic)
    records = tuple(
        replace(one, measured={"velocity": np.gradient(one.measured["displacement"], PERIOD_S)})
        for one in problem.records
    )
    along = Direction("stiffness.quintic", "coefficient", "", {}, 900.0)
    solved = Regression(parent.hypothesis, replace(problem, records=records), [along]).solve((0,))
    assert solved.steps[0] == pytest.approx(1.0, rel=0.2)


def test_the_noise_of_many_samples_in_a_period_is_no_speed() -> None:
    period_s, rate = 2.5e-4, 2.0 * np.pi * 20.0
    t = period_s * np.arange(4000)
    reading = np.sin(rate * t) + 0.01 * np.random.default_rng(1).standard_normal(len(t))
    record = FitRecord(
        name="fast", stimulus=Stimulus(inputs={"drive": 0.0 * t}, holds={"drive": "linear"}, period_s=period_s),
        measured={"displacement": reading},
    )  # fmt: skip
    z, v = sample_motion(record, 0.35 / 20.0)
    speed, inner = rate * np.cos(rate * t), slice(100, -100)
    between = np.diff(z) / period_s - 0.5 * (speed[1:] + speed[:-1])
    assert np.std((v - speed)[inner]) < 0.05 * np.std(speed)
    assert np.std(between[inner]) < 0.05 * np.std(speed)


def test_a_law_whose_states_run_away_along_the_motion_is_none() -> None:
    """A spring that yields within a step."""
    model = device(stiffness=(1.0e4, "1/s^2"), stiffness_cubic=(3e4, "1/(mm^2*s^2)"))
    problem, parent = case(model, STOPS)
    yielding = Direction("friction.presliding", "level", "", {"displacement": 0.034}, 1e6)
    grid = [one for one in parent.directions if one.mechanism == "stop.two_sided"]
    regression = Regression(parent.hypothesis, problem, [yielding, *grid])
    assert np.isfinite(regression.solve((0,)).left)
    assert all(regression.directions[group[0]].mechanism == "stop.two_sided" for group in regression.groups())
