"""Of sets that the data do not tell apart the one of the fewest unknowns is chosen, if it passes."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import fit_of, friction_case, problem_of

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.elimination.simpler_laws import prefer_fewest_unknowns
from rtctl.diagnosis.search.model_selection import count_unknowns, rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.state import SearchSettings
from rtctl.measured import read_dataset

IDS = ("friction.coulomb", "friction.presliding", "stiffness.cubic")
SETTINGS = SearchSettings(ids=IDS, level=0.01, budget=WorkBudget.of(np.inf))


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    return problem_of(read_dataset(friction_case(tmp_path_factory.mktemp("friction"))))


def fit_and_test(problem: Problem, *mechanisms: str) -> TestedHypothesis:
    return run_residual_tests(fit_of(problem, *mechanisms), problem, IDS)


def result(problem: Problem, chosen: TestedHypothesis, *others: TestedHypothesis) -> SearchResult:
    fits = [one.hypothesis for one in (chosen, *others)]
    ranking = rank_hypotheses(problem, fits, chosen, plain=False)
    return SearchResult(fit_and_test(problem), chosen, True, (), (ranking,))


def test_of_two_laws_that_fit_alike_the_one_of_fewer_unknowns_is_chosen(problem: Problem) -> None:
    """Dahl's law with a stiff contact is dry friction, and has one number more."""
    dry, dahl = fit_and_test(problem, "friction.coulomb"), fit_and_test(problem, "friction.presliding")
    assert count_unknowns(dry.hypothesis) < count_unknowns(dahl.hypothesis)
    found = prefer_fewest_unknowns(problem, result(problem, dahl, dry), SETTINGS)
    assert found.chosen.hypothesis is dry.hypothesis
    unchanged = result(problem, dry, dahl)
    assert prefer_fewest_unknowns(problem, unchanged, SETTINGS) is unchanged


def test_a_law_that_fits_worse_is_not_chosen_for_its_fewer_unknowns(problem: Problem) -> None:
    dahl, cubic = fit_and_test(problem, "friction.presliding"), fit_and_test(problem, "stiffness.cubic")
    assert count_unknowns(cubic.hypothesis) < count_unknowns(dahl.hypothesis)
    unchanged = result(problem, dahl, cubic)
    assert prefer_fewest_unknowns(problem, unchanged, SETTINGS) is unchanged
