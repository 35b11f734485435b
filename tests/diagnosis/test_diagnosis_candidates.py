"""A mechanism that the set's own parameters nearly imitate starts where these have made room; two may start at once."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, fit_of, friction_case, measured, noise_drive, problem_of
from scipy.optimize import nnls

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.directions import Direction
from rtctl.diagnosis.residual.projection import RecordRows, project
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.proposals.candidates import (
    _feasible_step,
    _limit_step,
    _make_room,
    interleave,
    propose_candidates,
    propose_pairs,
)
from rtctl.diagnosis.search.successive_halving import Candidate, halve_successively
from rtctl.diagnosis.thresholds import SearchThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset

SAMPLES = 500
LIMITS = SearchThresholds()


def way_of(apart: float, step: float = 2.0) -> np.ndarray:
    """Of two own parameters, for a direction that is 3 times the second and `apart` something of its own."""
    rng = np.random.default_rng(0)
    shared, own = rng.standard_normal((2, 1, SAMPLES)), rng.standard_normal((1, 1, SAMPLES))
    rows = RecordRows(
        residual=rng.standard_normal((1, SAMPLES)), shared=shared, local=np.zeros((0, 1, SAMPLES)),
        directions=3.0 * shared[1:] + apart * own,
    )  # fmt: skip
    projected = project([rows], [NoiseModel(np.empty(0), 1.0)])
    parent: Any = SimpleNamespace(projected=projected, hypothesis=SimpleNamespace(shared=np.zeros(2)))
    return _make_room(parent, [0], np.array([step]), LIMITS)


def test_they_take_back_what_it_adds_along_them() -> None:
    assert way_of(0.1) == pytest.approx([0.0, -6.0], abs=0.05)


@pytest.mark.parametrize("apart", [3.0, 1e-5])
def test_they_stay_where_it_has_a_sign_of_its_own_or_none_at_all(apart: float) -> None:
    assert way_of(apart) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_step_ends_where_a_parameter_of_the_set_would_leave_all_that_is_linear_about_it() -> None:
    parent: Any = SimpleNamespace(hypothesis=SimpleNamespace(shared=np.array([4.0, 0.1])))
    assert _limit_step(parent, np.array([-16.0, 0.0]), LIMITS) == pytest.approx(
        LIMITS.own_step_limit * 4.0 / 16.0
    )
    assert _limit_step(parent, np.array([0.0, 2.0]), LIMITS) == pytest.approx(
        LIMITS.own_step_limit * 1.0 / 2.0
    )  # of its typical size
    assert _limit_step(parent, np.zeros(2), LIMITS) > 1.0


def nominal_with_tests(
    ids: tuple[str, ...], *mechanisms: dict[str, object]
) -> tuple[Problem, TestedHypothesis]:
    """The nominal model beside two records of a device that has `mechanisms`."""
    records = tuple(
        FitRecord(
            name=f"r{seed}",
            stimulus=Stimulus(
                inputs={"drive": noise_drive(seed)}, holds={"drive": "linear"}, period_s=PERIOD_S
            ),
            measured={"displacement": measured(device(*mechanisms), noise_drive(seed))},
        )
        for seed in (1, 2)
    )
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_from_starts(problem, device(), ())
    assert nominal is not None
    return problem, run_residual_tests(nominal, problem, ids)


def test_two_that_no_single_one_leads_to_begin_at_once_from_the_model_without_either() -> None:
    late = {"id": "drive.lag", "parameters": {"time_constant": {"value": 1e-3, "unit": "s"}}}
    cubic = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 150.0, "unit": "1/(mm^2*s^2)"}}}
    ids = ("drive.lag", "stiffness.cubic", "stiffness.quadratic", "drive.offset", "drive.deadband")
    problem, parent = nominal_with_tests(ids, late, cubic)
    pairs = propose_pairs(parent, LIMITS)
    assert len(pairs) == LIMITS.pairs_tried
    assert set(pairs[0].mechanisms) == {"drive.lag", "stiffness.cubic"}
    start = {one.name: one.value for one in pairs[0].simulation.parameters}
    assert 0.1 * LIMITS.pair_factor < start["drive.lag.time_constant"] / 1e-3 < 3.0 * LIMITS.pair_factor
    assert 0.1 * LIMITS.pair_factor < start["stiffness.cubic.coefficient"] / 150.0 < 3.0 * LIMITS.pair_factor
    best = halve_successively(problem, pairs, lambda text: None)[0]
    assert set(best.mechanisms) == {"drive.lag", "stiffness.cubic"}
    found = {one.name: value for one, value in zip(best.simulation.parameters, best.values, strict=True)}
    assert found["drive.lag.time_constant"] == pytest.approx(1e-3, rel=0.1)
    assert found["stiffness.cubic.coefficient"] == pytest.approx(150.0, rel=0.1)


@pytest.mark.parametrize(
    ("frequency_hz", "mass_ratio", "tried"),
    [(24.0, 2e-3, 3), pytest.param(21.0, 1e-3, 1, marks=pytest.mark.slow)],
)
def test_where_a_frequency_is_looked_for_three_are_tried_and_none_with_a_mass_below_zero(
    frequency_hz: float, mass_ratio: float, tried: int
) -> None:
    attached = {
        "id": "mode.second",
        "parameters": {
            "mass_ratio": {"value": mass_ratio, "unit": "1"},
            "frequency": {"value": frequency_hz, "unit": "Hz"},
            "damping_ratio": {"value": 0.01, "unit": "1"},
        },
    }
    problem, parent = nominal_with_tests(("mode.second",), attached)
    begun = [dict(_shown(one)) for one in propose_candidates(parent, LIMITS) if one.form == "mass_ratio"]
    assert len({one["frequency"] for one in begun}) == tried
    assert all(one["mass_ratio"] > 0.0 for one in begun)
    best = halve_successively(problem, propose_candidates(parent, LIMITS), lambda text: None)[0]
    found = {
        one.declared.name: value for one, value in zip(best.simulation.parameters, best.values, strict=True)
    }
    assert found["frequency"] == pytest.approx(frequency_hz, rel=0.01)
    assert found["mass_ratio"] == pytest.approx(mass_ratio, rel=0.1)


def _shown(candidate: Candidate) -> list[tuple[str, float]]:
    return [(one.declared.name, one.value) for one in candidate.simulation.parameters if one.mechanism]


def test_where_time_runs_out_no_set_goes_without_a_fit_for_anothers_second_start() -> None:
    def one(name: str, start: int) -> Any:
        return SimpleNamespace(mechanisms=(name,), form="", start=start)

    first, other = [one("a", 0), one("a", 1), one("b", 0)], [one("c", 0), one("c", 1), one("d", 0)]
    turns = [(*candidate.mechanisms, candidate.start) for candidate in interleave([first, other])]
    assert turns == [("a", 0), ("c", 0), ("b", 0), ("d", 0), ("a", 1), ("c", 1)]
    assert interleave([first]) == [first[0], first[2], first[1]]


def parent_along(sizes: list[float], least: list[float]) -> Any:
    """A set without parameters whose residual is `sizes` times directions that share a part, with their least steps."""
    rng = np.random.default_rng(1)
    common = rng.standard_normal((1, 1, SAMPLES))
    own = rng.standard_normal((len(sizes), 1, SAMPLES)) + 0.8 * common
    noise = 1e-6 * rng.standard_normal((1, SAMPLES))
    rows = RecordRows(
        residual=-np.einsum("k,kon->on", np.array(sizes), own) + noise,
        shared=np.zeros((0, 1, SAMPLES)), local=np.zeros((0, 1, SAMPLES)), directions=own,
    )  # fmt: skip
    directions = [Direction("m", f"a{k}", "", {}, 1.0, least=low) for k, low in enumerate(least)]
    projected = project([rows], [NoiseModel(np.empty(0), 1.0)])
    return SimpleNamespace(
        projected=projected, directions=directions, hypothesis=SimpleNamespace(shared=np.zeros(0))
    )


@pytest.mark.parametrize("sizes", [[2.0, 0.5, -0.3], [-1.0, 0.7, -0.2], [-1.0, -0.5, -2.0], [0.4, -3.0, 0.1]])
def test_steps_that_bounds_allow_are_those_of_non_negative_least_squares(sizes: list[float]) -> None:
    parent = parent_along(sizes, [0.0, 0.0, 0.0])
    found = _feasible_step(parent, [0, 1, 2])
    gram = parent.projected.left[1:, 1:]
    root = np.linalg.cholesky(gram).T
    oracle, _ = nnls(root, np.linalg.solve(root.T, -parent.projected.left[1:, 0]))
    assert found * parent.projected.scale[1:] / parent.projected.scale[0] == pytest.approx(oracle, abs=1e-6)


def test_what_would_have_to_be_negative_does_not_move_unless_it_may() -> None:
    bounded, free = parent_along([-1.0], [0.0]), parent_along([-1.0], [-np.inf])
    assert _feasible_step(bounded, [0]) == 0.0
    assert _feasible_step(free, [0]) == pytest.approx(-1.0, rel=1e-3)


def test_a_mechanism_whose_size_would_have_to_be_negative_starts_where_the_parent_is(tmp_path: Path) -> None:
    """Beside a damping that makes up for it, dry friction is the opposite of one that grows with the speed."""
    problem = problem_of(read_dataset(friction_case(tmp_path)))
    ids = ("friction.coulomb", "damping.quadratic", "damping.nonlinear")
    parent = run_residual_tests(fit_of(problem), problem, ids)
    own = [one.value for one in parent.hypothesis.simulation.parameters]
    begun = propose_candidates(parent, LIMITS)
    (still,) = [one for one in begun if one.mechanisms == ("damping.quadratic",)]
    assert [one.value for one in still.simulation.parameters][: len(own)] == own
    for moved in begun:
        if moved is still:
            continue
        assert moved.simulation.parameters != moved.neutral.parameters, (
            f"{moved.mechanisms} acts from the start"
        )
