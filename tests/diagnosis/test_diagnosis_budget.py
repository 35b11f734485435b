"""A search whose time runs out begins no further fit, tells the best that it has, and says so."""

from __future__ import annotations

import time
from itertools import count
from pathlib import Path

import numba
import numpy as np
from diagnosis_cases import PERIOD_S, device, friction_case, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.budget import AFTER, LEAST, Budget
from rtctl.diagnosis.problem.hypothesis import Problem, fit_hypothesis
from rtctl.diagnosis.search.catalogue_search import DiagnosisOptions
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import scales_of
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.plants.subjects import SUBJECTS
from rtctl.session.model_validation import simulation_for


def test_a_budget_is_spent_when_its_clock_has_run_so_far() -> None:
    ticks = count()
    budget = Budget.of(3.0, lambda: float(next(ticks)))  # begins at 0
    assert [budget.spent for _ in range(4)] == [False, False, True, True]


def test_a_further_comparison_ends_soon_after_it() -> None:
    now = [0.0]
    budget = Budget.of(70.0, lambda: now[0])
    assert budget.further(15.0).seconds == 15.0
    now[0] = 77.0
    assert budget.further(15.0).seconds == 70.0 + AFTER - 77.0
    now[0] = 95.0
    assert budget.further(15.0).seconds == LEAST


def test_what_the_compiler_takes_spends_nothing_of_it() -> None:
    def inner(x: float) -> float:
        return x + 1.0

    within = numba.njit(inner)

    def outer(x: float) -> float:
        return float(within(x) + within(2.0 * x))

    budget, begun = Budget.of(), time.process_time()
    numba.njit(outer)(1.0)
    spent, of_it = time.process_time() - begun, budget.clock() - budget.begun
    assert of_it < 0.5 * spent


def test_a_fit_ends_where_it_is_once_it_is_spent() -> None:
    stimulus = Stimulus(inputs={"drive": noise_drive(1)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    readings = {"displacement": measured(device(), noise_drive(1))}
    record = FitRecord(name="r", stimulus=stimulus, measured=readings)
    problem = Problem(subject=SUBJECTS["oscillator"], records=(record,), scales=scales_of((record,)))
    values = np.array([1.05 * one.value for one in device().parameters])
    start = device().with_values(values)
    asked = count()
    left = [
        fit_hypothesis(problem.until(Budget.of(most, lambda: float(next(asked)))), start, ())
        for most in (0.0, 2.0, 99.0)
    ]
    costs = [one.cost for one in left if one is not None]
    assert costs[0] == fit_hypothesis(problem, start, (), iterations=0).cost  # type: ignore[union-attr]
    assert costs[0] > costs[1] > costs[2]


def test_without_time_nothing_is_fitted_no_cause_is_claimed_and_the_answer_says_so(tmp_path: Path) -> None:
    manifest = friction_case(tmp_path)
    heard: list[str] = []
    model = tmp_path / "model.toml"
    found = diagnose(
        read_dataset(manifest), read_oscillator_model(model), simulation_for(model, open_dataset(manifest)),
        ("friction.coulomb", "stiffness.cubic"), DiagnosisOptions(seconds=0.0, threads=1), heard.append,
    )  # fmt: skip
    assert heard == ["the nominal model"]
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert found.search.out_of_time
    assert "ended after 0 s of processor time" in found.warnings[-1]
    assert found.json["out_of_time"] is True
