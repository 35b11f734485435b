"""The isolability matrix: cosines of what two effects leave beyond the nominal parameters, known before any name."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from diagnosis_cases import FRICTION, PERIOD_S, UNITS, device, measured, noise_drive
from scipy.stats import norm

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.experiment_design.isolability import Isolability, compute_isolability
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import mechanism_sensitivities
from rtctl.diagnosis.residual.missing_force import estimate_missing_force
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.plants.oscillator.diagnosis import OSCILLATOR

IDS = (
    "stiffness.cubic",
    "friction.coulomb",
    "damping.quadratic",
    "drive.delay",
    "drive.lag",
    "sensor.offset",
)


@cache
def examined() -> tuple[Problem, TestedHypothesis]:
    """The nominal model re-fitted to two records of the device with friction."""
    plant, records = device(FRICTION), []
    for seed, level in ((1, 6.0), (2, 9.0)):
        drive = noise_drive(seed, level)
        reading = measured(plant, drive)
        stimulus = Stimulus(
            inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": float(reading[0])}, peak={"displacement": float(np.abs(reading).max())},
        )  # fmt: skip
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}))
    problem = Problem(
        subject=OSCILLATOR, records=tuple(records), scales=estimate_scales(records), steps_per_period=64.0
    )
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    return problem, run_residual_tests(nominal, problem, IDS)


def test_the_cosine_is_the_one_of_the_parts_that_no_nominal_parameter_follows() -> None:
    problem, at = examined()
    found = compute_isolability(at)
    pair = ("friction.coulomb", "damping.quadratic")
    whole: list[list[np.ndarray]] = [[], [], []]
    lines = at.hypothesis.linearise(problem)
    for index, line in enumerate(lines):
        own = np.zeros((2 * len(lines), line.local.shape[2]))
        own[2 * index : 2 * index + 2] = line.local[:, 0]
        follows = np.concatenate((line.shared[:, 0], own))
        white = at.noise[0].whiten
        whole[0].append(white(follows))
        for k, identity in enumerate(pair):
            mine = [d for d in at.directions if d.mechanism == identity]
            whole[1 + k].append(white(mechanism_sensitivities(at.hypothesis, mine, problem, index)[0, 0]))
    basis = np.linalg.qr(np.concatenate(whole[0], axis=1).T)[0]
    left, visible = [], []
    for parts in whole[1:]:
        trace = np.concatenate(parts)
        left.append(trace - basis @ (basis.T @ trace))
        visible.append(left[-1] @ left[-1] / (trace @ trace))
    expected = abs(left[0] @ left[1]) / np.linalg.norm(left[0]) / np.linalg.norm(left[1])
    row, column = (found.ids.index(identity) for identity in pair)
    assert found.cosine[row, column] == pytest.approx(expected, abs=0.01)
    needed = norm.isf(0.5 * 0.01 / len(IDS)) + norm.isf(
        0.1
    )  # of the level of each test, seen nine times of ten
    expected = needed / np.sqrt(at.projected.samples * np.array(visible))
    assert found.unseen[[row, column]] == pytest.approx(expected, rel=0.01)


def test_a_delay_and_a_lag_of_the_drive_are_known_to_be_inseparable_and_friction_is_not() -> None:
    found = compute_isolability(examined()[1])
    assert set(found.ids) == set(IDS)
    assert found.closest("drive.delay") == ("drive.lag",)
    assert found.closest("friction.coulomb") == ()
    assert np.allclose(found.cosine, found.cosine.T)
    assert np.allclose(np.diag(found.cosine), 1.0)
    assert np.all((found.visible > 0.0) & (found.visible <= 1.0))


def test_the_missing_force_is_drawn_as_the_step_of_dry_friction() -> None:
    problem, at = examined()
    shape = estimate_missing_force(at, problem, ["state", "velocity_sign"], UNITS)
    assert shape is not None
    assert (shape.coordinate, shape.unit, shape.force_unit) == ("velocity", "mm/s", "mm/s^2")
    assert shape.share > 0.8
    assert shape.error.max() < 0.3 * 450.0
    assert np.sort(np.abs(shape.knots))[1] < 0.05 * shape.knots.max(), "a jump at rest is no slope"
    v, weight = shape.knots, 1.0 / shape.error
    columns = np.stack((-np.sign(v), v, np.ones_like(v)), axis=1) * weight[:, None]
    level = np.linalg.lstsq(columns, shape.force * weight)[0][0]
    assert level == pytest.approx(450.0, rel=0.15)  # less the straight line that the nominal damping took


def test_a_shape_needs_a_coordinate_that_is_one_number() -> None:
    problem, at = examined()
    assert estimate_missing_force(at, problem, ["state", "amplitude"], UNITS) is None


def test_a_mechanism_that_is_a_parameter_of_the_model_is_no_unseen_effect() -> None:
    found = Isolability(
        ids=("stiffness.cubic", "sensor.offset"),
        visible=np.zeros(2),
        cosine=np.eye(2),
        followers=(("stiffness_cubic",), ("damping",)),
        unseen=np.array([np.inf, np.inf]),
    )
    assert found.followed(10.0) == {("damping",): ("sensor.offset",)}
