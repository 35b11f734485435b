"""A small cause is told only if it helps on records that no fit saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import FRICTION, PERIOD_S, device, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import drop_inactive_causes, refit_without_each
from rtctl.diagnosis.search.elimination.holdout_support import add_untold_rivals, drop_unsupported
from rtctl.diagnosis.search.model_selection import RankedHypothesis, rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

IDS = ("friction.coulomb", "sensor.offset", "stiffness.cubic")
OFFSET_MM = 0.004


FRICTION_FREE = ()
ASYMMETRIC: dict[str, object] = {
    "id": "stiffness.quadratic",
    "parameters": {"coefficient": {"value": 2e3, "unit": "1/(mm*s^2)"}},
}


def record_of(seed: int, offset_mm: float, effects: tuple[dict[str, object], ...] = (FRICTION,)) -> FitRecord:
    """Of the device with friction, or with other effects, read with an offset."""
    drive = noise_drive(seed)
    reading = measured(device(*effects), drive) + offset_mm
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])}, peak={"displacement": float(np.abs(reading).max())},
    )  # fmt: skip
    return FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)


def fit_of(problem: Problem, *mechanisms: str) -> Hypothesis:
    found = fit_hypothesis(problem, device().extended(mechanisms), mechanisms)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def searched() -> tuple[Problem, SearchResult]:
    """A search that chose friction and an offset, by two records that have both."""
    records = tuple(record_of(seed, OFFSET_MM) for seed in (1, 2))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = run_residual_tests(fit_of(problem), problem, IDS)
    both = run_residual_tests(fit_of(problem, "friction.coulomb", "sensor.offset"), problem, IDS)
    tried = tuple(
        rank_hypotheses(problem, field, both, plain=False)
        for field in ([fit_of(problem, "friction.coulomb")], [both.hypothesis])
    )
    without = refit_without_each(problem, nominal.hypothesis, both.hypothesis)
    return problem, SearchResult(nominal, both, True, (), tried, without)


def supported_by(
    searched: tuple[Problem, SearchResult], tests: Sequence[FitRecord]
) -> tuple[set[str], tuple[str, ...]]:
    problem, found = searched
    left, dropped = drop_unsupported(found, problem, tests, IDS, WorkBudget.of(60.0))
    assert left.chosen.tests == found.chosen.tests
    return set(left.chosen.hypothesis.mechanisms), dropped


def test_a_small_cause_that_the_test_records_have_too_stays(searched: tuple[Problem, SearchResult]) -> None:
    names, dropped = supported_by(searched, [record_of(7, OFFSET_MM)])
    assert names == {"friction.coulomb", "sensor.offset"}
    assert dropped == ()


def test_one_that_makes_them_worse_is_not_told_and_the_large_one_is(
    searched: tuple[Problem, SearchResult],
) -> None:
    names, dropped = supported_by(searched, [record_of(7, 0.0), record_of(8, 0.0)])
    assert names == {"friction.coulomb"}
    assert dropped == ("sensor.offset",)


@pytest.mark.parametrize(
    ("fitted_mm", "tested_mm", "verdict"),
    [
        (4e-4, 0.0, "adequate"),
        (4e-4, 4e-4, "explained"),
        pytest.param(1.5e-4, 1.5e-4, "adequate", id="hardly seen"),
    ],
)
def test_a_cause_alone_that_is_small_beside_the_noise_is_asked_as_well(
    fitted_mm: float, tested_mm: float, verdict: str
) -> None:
    records = tuple(record_of(seed, fitted_mm, FRICTION_FREE) for seed in (1, 2))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = run_residual_tests(fit_of(problem), problem, IDS)
    offset = run_residual_tests(fit_of(problem, "sensor.offset"), problem, IDS)
    tried = (rank_hypotheses(problem, [offset.hypothesis], offset, plain=False),)
    found = SearchResult(nominal, offset, True, (), tried, (nominal.hypothesis,))
    assert 0.0 < nominal.hypothesis.cost - offset.hypothesis.cost < 0.05 * offset.hypothesis.cost
    tests = [record_of(seed, tested_mm, FRICTION_FREE) for seed in (7, 8, 9)]
    left, dropped = drop_unsupported(found, problem, tests, IDS, WorkBudget.of(60.0))
    assert dropped == (("sensor.offset",) if verdict == "adequate" else ())
    assert classify_outcome(left, 0.9, problem.thresholds.search) == verdict


def test_without_test_records_nothing_is_dropped(searched: tuple[Problem, SearchResult]) -> None:
    assert supported_by(searched, []) == ({"friction.coulomb", "sensor.offset"}, ())


def test_records_that_cannot_be_simulated_say_nothing_nor_does_a_diagnosis_that_is_out_of_time(
    searched: tuple[Problem, SearchResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, found = searched
    tests = [record_of(7, 0.0)]
    assert drop_unsupported(found, problem, tests, IDS, WorkBudget.of(0.0)) == (found, ())
    monkeypatch.setattr(
        "rtctl.diagnosis.search.elimination.holdout_support.compute_free_run_error",
        lambda *_: np.full(9, np.inf),
    )
    assert drop_unsupported(found, problem, tests, IDS, WorkBudget.of(60.0)) == (found, ())


def test_a_cause_of_which_the_size_ended_at_nothing_is_not_told(
    searched: tuple[Problem, SearchResult],
) -> None:
    """The gate let both pass, and the motion without it is the same."""
    problem, found = searched
    beside = device(FRICTION).extended(("stiffness.viscoelastic",))
    made = fit_hypothesis(problem, beside, ("friction.coulomb", "stiffness.viscoelastic"), iterations=0)
    assert made is not None
    both = run_residual_tests(made, problem, IDS)
    tried = (found.rankings[0], rank_hypotheses(problem, [made], both, plain=False))
    left = drop_inactive_causes(problem, SearchResult(found.nominal, both, True, (), tried), IDS)
    assert left.chosen.hypothesis.mechanisms == ("friction.coulomb",)
    assert left.chosen.tests == both.tests
    assert drop_inactive_causes(problem, found, IDS) is found


def test_a_rival_that_the_test_records_do_not_tell_apart_stands_beside_the_chosen_set(
    searched: tuple[Problem, SearchResult],
) -> None:
    """One rival predicts the same, the other knows nothing of the offset; both fit about as well as the chosen set."""
    problem, found = searched
    own, near = found.chosen.hypothesis, 1.02 * found.chosen.hypothesis.cost
    same = replace(own, mechanisms=("friction.coulomb", "sensor.lag"), cost=near)
    worse = replace(fit_of(problem, "friction.coulomb", "stiffness.cubic"), cost=near)
    far = replace(same, mechanisms=("friction.coulomb", "drive.lag"), cost=1.2 * own.cost)
    ranking = tuple(RankedHypothesis(one, 0.0) for one in (own, same, worse, far))
    found = found._replace(rankings=(found.rankings[0], ranking))
    tests = [record_of(7, OFFSET_MM), record_of(8, OFFSET_MM)]
    tolerant = replace(problem, allowed={"displacement": 1e-12})
    assert add_untold_rivals(found, tolerant, tests).equivalent == (same,)
    assert add_untold_rivals(found, problem, tests) is found, (
        "where no misfit is allowed, the likelihood decides"
    )
