"""A search that ends without a set that passes tries what the tests of its best set point to."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.model_selection import rank_hypotheses
from rtctl.diagnosis.search.state import SearchSettings, SearchState, StopReason
from rtctl.diagnosis.search.stepwise import conclude_search
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

IDS = ("damping.quadratic", "sensor.offset", "stiffness.cubic", "stiffness.quadratic")
UNIT = "1/(mm*s^2)"
TRUE = 4e3


def record_of(seed: int) -> FitRecord:
    """Of the device with a quadratic spring, which softens it as a cubic one does."""
    drive = noise_drive(seed)
    quadratic = {"id": "stiffness.quadratic", "parameters": {"coefficient": {"value": TRUE, "unit": UNIT}}}
    reading = measured(device(quadratic), drive)
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])}, peak={"displacement": float(np.abs(reading).max())},
    )  # fmt: skip
    return FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)


@pytest.fixture(scope="module")
def state() -> SearchState:
    """Of a search whose work was spent when it had tried a cubic spring alone."""
    records = tuple(record_of(seed) for seed in (1, 2))
    subject = subject_of("oscillator")
    problem = Problem(
        subject=subject, records=records, scales=estimate_scales(records), steps_per_period=64.0
    )

    def fit(*mechanisms: str) -> Hypothesis:
        found = fit_hypothesis(problem, device().extended(mechanisms), mechanisms)
        assert found is not None
        return found

    nominal, cubic = (
        run_residual_tests(fit(), problem, IDS),
        run_residual_tests(fit("stiffness.cubic"), problem, IDS),
    )
    settings = SearchSettings(ids=IDS, level=0.002, budget=WorkBudget.of(math.inf))
    ranking = rank_hypotheses(problem, [cubic.hypothesis], cubic, plain=True)
    return SearchState(
        settings=settings, given=problem, problem=problem, nominal=nominal, best=cubic, smaller=nominal,
        parents=(cubic,), fits=(cubic.hypothesis,), rankings=(ranking,), size=1, stop=StopReason.OUT_OF_WORK,
    )  # fmt: skip


def test_the_cause_that_another_stood_in_for_takes_its_place(state: SearchState) -> None:
    result = conclude_search(state)
    assert result.passes
    assert result.chosen.hypothesis.mechanisms == ("stiffness.quadratic",)
    found = {one.name: one.value for one in result.chosen.hypothesis.simulation.parameters}
    assert found["stiffness.quadratic.coefficient"] == pytest.approx(TRUE, rel=0.05)


def test_without_that_the_stand_in_is_what_is_left(state: SearchState) -> None:
    limits = replace(state.problem.thresholds.search, followed_cost=0.0)
    thresholds = replace(state.problem.thresholds, search=limits)
    result = conclude_search(replace(state, problem=replace(state.problem, thresholds=thresholds)))
    assert not result.passes
    assert result.chosen.hypothesis.mechanisms == ("stiffness.cubic",)
