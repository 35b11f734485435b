"""Where no set passes, a law that is a case of another one is tried as that, from where the case ended."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, measured, noise_drive

from plant_sim.oscillator.mechanisms import MECHANISMS
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.elimination.general_laws import fit_general_laws, starts_of_general_laws
from rtctl.diagnosis.search.state import SearchSettings
from rtctl.diagnosis.search.stepwise import search_stepwise
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

BOUC_WEN = {
    "id": "hysteresis.bouc_wen",
    "parameters": {
        "level": {"value": 900.0, "unit": "mm/s^2"},
        "displacement": {"value": 0.6, "unit": "mm"},
        "loop": {"value": 0.5, "unit": "dimensionless"},
        "bend": {"value": -0.2, "unit": "dimensionless"},
    },
}
IDS = ("friction.presliding", "hysteresis.bouc_wen", "damping.quadratic")


STRIBECK = {
    "id": "friction.stribeck",
    "parameters": {
        "level": {"value": 300.0, "unit": "mm/s^2"},
        "excess": {"value": 250.0, "unit": "mm/s^2"},
        "transition_speed": {"value": 60.0, "unit": "mm/s"},
    },
}


def fitted(mechanism: dict[str, object]) -> tuple[Problem, Hypothesis]:
    """Records of a device with a mechanism, and the nominal model fitted to them."""
    plant, drives = device(mechanism), [noise_drive(seed) for seed in range(2)]
    records = tuple(
        FitRecord(
            name=f"r{k}",
            stimulus=Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S),
            measured={"displacement": measured(plant, drive)},
        )
        for k, drive in enumerate(drives)
    )
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    return problem, nominal


@pytest.fixture(scope="module")
def hysteretic() -> tuple[Problem, Hypothesis]:
    return fitted(BOUC_WEN)


def of_law(problem: Problem, nominal: Hypothesis, identity: str) -> Hypothesis:
    """The nominal model with a law of a level, from 500 mm/s^2."""
    extended = nominal.simulation.extended((identity,))
    values = np.array([one.value for one in extended.parameters])
    values[[one.name == f"{identity}.level" for one in extended.parameters]] = 500.0
    fit = fit_hypothesis(problem, extended.with_values(values), (identity,), nominal.starts)
    assert fit is not None
    return fit


def test_dahls_law_is_tried_as_a_case_of_bouc_and_wens(hysteretic: tuple[Problem, Hypothesis]) -> None:
    problem, nominal = hysteretic
    case = of_law(problem, nominal, "friction.presliding")
    settings = SearchSettings(ids=IDS, level=0.01, budget=WorkBudget.of(60e8))
    general, *others = fit_general_laws(problem, nominal, case, settings)
    assert {one.mechanisms for one in (general, *others)} == {("hysteresis.bouc_wen",)}
    assert general.cost < 0.9 * case.cost
    assert fit_general_laws(problem, nominal, general, settings) == []
    without = SearchSettings(ids=IDS[:1], level=0.01, budget=WorkBudget.of(60e8))
    assert fit_general_laws(problem, nominal, case, without) == []


def test_a_shape_that_the_case_lacks_is_looked_for() -> None:
    """The excess of Stribeck's friction fades over a speed, and a fit from another one does not find it."""
    problem, nominal = fitted(STRIBECK)
    case = of_law(problem, nominal, "friction.coulomb")
    settings = SearchSettings(ids=("friction.stribeck",), level=0.01, budget=WorkBudget.of(60e8))
    general, *further = fit_general_laws(problem, nominal, case, settings)
    assert len(further) == 2
    found = {one.name: one.value for one in general.simulation.parameters}
    assert found["friction.stribeck.transition_speed"] == pytest.approx(60.0, rel=0.1)
    assert found["friction.stribeck.excess"] == pytest.approx(250.0, rel=0.1)


CASES = [(case, law.id) for law in MECHANISMS.values() for case in law.generalises]


@pytest.mark.parametrize(("case", "law"), CASES)
def test_every_law_starts_from_each_of_its_cases(
    hysteretic: tuple[Problem, Hypothesis], case: str, law: str
) -> None:
    problem, nominal = hysteretic
    fit = fit_hypothesis(problem, nominal.simulation.extended((case,)), (case,), nominal.starts, 0)
    assert fit is not None
    starts = list(starts_of_general_laws(problem, nominal, fit, [law]))
    assert {one.mechanisms for one in starts} == {(law,)}
    for start in starts:
        assert np.isfinite([one.value for one in start.simulation.parameters]).all()


def test_stops_with_nothing_between_them_are_no_free_play_about_their_middle() -> None:
    at_rest = {"stiffness": 0.0, "lower": 0.0, "upper": 0.0, "retardation_time": 0.0}
    as_clearance = MECHANISMS["stop.two_sided"].generalises["stiffness.clearance"]
    assert as_clearance(at_rest) == {"gap": 0.0, "centre": 0.0}
    assert as_clearance(at_rest | {"lower": 1.0, "upper": 3.0}) == {"gap": 1.0, "centre": 2.0}


def test_of_two_stops_the_nearer_one_is_the_one_that_may_be_alone() -> None:
    """A lower stop was compared with the upper one alone, which the motion hardly reaches."""
    both = {"stiffness": 5.0, "lower": -1.0, "upper": 3.0, "retardation_time": 0.1}
    as_one = MECHANISMS["stop.two_sided"].generalises["stop.one_sided"]
    assert as_one(both) == {"below": 5.0, "place": -1.0, "retardation_time": 0.1}
    assert as_one(both | {"lower": -4.0}) == {"above": 5.0, "place": 3.0, "retardation_time": 0.1}


def test_a_search_that_ends_with_a_case_names_the_law(
    hysteretic: tuple[Problem, Hypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The race has no candidate of the general law: as where the work is used up before it comes to it."""
    from rtctl.diagnosis.search import stepwise

    propose = stepwise.propose_candidates
    monkeypatch.setattr(
        stepwise,
        "propose_candidates",
        lambda *given: [one for one in propose(*given) if "hysteresis.bouc_wen" not in one.mechanisms],
    )
    monkeypatch.setattr(stepwise, "propose_pairs", lambda *given: [])
    problem, nominal = hysteretic
    settings = SearchSettings(ids=IDS, level=0.01, budget=WorkBudget.of(60e8))
    found = search_stepwise(problem, nominal, settings)
    assert found.passes
    assert found.chosen.hypothesis.mechanisms == ("hysteresis.bouc_wen",)
