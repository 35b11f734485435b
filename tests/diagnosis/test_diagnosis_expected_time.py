"""Before a search begins it is told how long it takes; the budget of the search does not notice."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path

import pytest
from diagnosis_cases import dataset_of, device, fit_of, measured, noise_drive, problem_of, write_case

from rtctl.api.diagnosing import diagnose
from rtctl.border.work import metered
from rtctl.diagnosis.nominal_fit.expected_time import ExpectedTime, expect_time, tell_time
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.thresholds import BudgetThresholds
from rtctl.output.fit_lines import Lasting


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Hypothesis]:
    """A record of the nominal device, and its fit."""
    drive = noise_drive(1)
    data = dataset_of(tmp_path_factory.mktemp("d"), (drive, measured(device(), drive), "fit"))
    problem = problem_of(data)
    return problem, fit_of(problem)


def test_a_user_reads_times_of_what_may_be_found() -> None:
    assert ExpectedTime(25.0, 70.4, 260.0).text == (
        "about 0:25 if one cause explains it, 1:10 if it takes two, 4:20 if it uses up its work budget; "
        "less if nothing is wrong"
    )
    assert ExpectedTime(25.0, 70.4, inf).text == (
        "about 0:25 if one cause explains it, 1:10 if it takes two; less if nothing is wrong"
    )


def test_times_are_so_many_evaluations_and_no_more_than_the_budget_allows(
    fitted: tuple[Problem, Hypothesis],
) -> None:
    amounts = BudgetThresholds(
        overrun=0.0, evaluations_of_one=10.0, evaluations_of_two=30.0, simulated_share=1.0
    )
    with metered() as meter:
        steps = lambda: meter.steps  # noqa: E731
        expect_time(*fitted, WorkBudget.of(inf, steps, thresholds=amounts))
        each = meter.steps / amounts.timed_evaluations
        endless = expect_time(*fitted, WorkBudget.of(inf, steps, thresholds=amounts))
        short = expect_time(*fitted, WorkBudget.of(20.0 * each, steps, thresholds=amounts))
    assert endless.two_s == pytest.approx(3.0 * endless.one_s)
    assert endless.most_s == inf
    assert short.two_s == short.most_s == pytest.approx(2.0 * short.one_s)


def test_a_model_that_is_quick_to_simulate_has_its_tests_still_to_pay(
    fitted: tuple[Problem, Hypothesis],
) -> None:
    """Half of a search's work is whitening and linear algebra, whose steps take as long whatever the model."""
    amounts = BudgetThresholds(overrun=0.0, simulated_share=0.5, other_step_s=1.0)
    with metered() as meter:
        found = expect_time(*fitted, WorkBudget.of(1000.0, lambda: meter.steps, thresholds=amounts))
    assert found.most_s > 499.0


def test_telling_the_time_is_no_part_of_the_budget(fitted: tuple[Problem, Hypothesis]) -> None:
    heard: list[str] = []
    with metered() as meter:
        before = WorkBudget.of(1e9, lambda: meter.steps)
        after = tell_time(*fitted, before, heard.append)
        assert meter.steps > 0.0
        assert after.left == 1e9
    (text,) = heard
    assert isinstance(text, Lasting)


def test_where_nothing_may_be_searched_nothing_is_told(fitted: tuple[Problem, Hypothesis]) -> None:
    heard: list[str] = []
    budget = replace(WorkBudget.of(1.0, lambda: 0.0), steps=0.0)
    assert tell_time(*fitted, budget, heard.append) is budget
    assert heard == []


def test_the_search_tells_it_before_the_first_cause(tmp_path: Path) -> None:
    uses = ((1, "fit"), (2, "test"))
    records = [(noise_drive(seed), measured(device(), noise_drive(seed)), use) for seed, use in uses]
    manifest = write_case(tmp_path, records)
    heard: list[str] = []
    diagnose(
        manifest, tmp_path / "model.toml", mechanisms="friction.coulomb",
        progress=lambda text, share: heard.append(text),
    )  # fmt: skip
    assert heard[0] == "the nominal model"
    assert heard[1].startswith("about 0:")
