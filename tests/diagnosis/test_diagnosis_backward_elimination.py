"""A cause that hardly matters beside the others is taken out again, and what each is worth is a fit without it."""

from __future__ import annotations

import pytest
from diagnosis_cases import device, fit_of, friction_case, problem_of

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import (
    _compensate,
    drop_unneeded_causes,
    eliminate_negligible,
    refit_without_each,
    takes_far_longer,
)
from rtctl.measured import read_dataset


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    return problem_of(read_dataset(friction_case(tmp_path_factory.mktemp("friction"))))


def test_what_does_not_help_is_taken_out_and_what_does_stays(problem: Problem) -> None:
    nominal, both = fit_of(problem), fit_of(problem, "friction.coulomb", "stiffness.quintic")
    kept = eliminate_negligible(problem, nominal, both)
    assert kept.mechanisms == ("friction.coulomb",)
    assert kept.cost == pytest.approx(fit_of(problem, "friction.coulomb").cost, rel=1e-3)
    assert eliminate_negligible(problem, nominal, kept) is kept


def test_what_the_records_need_is_what_bic_or_a_residual_test_asks_for(problem: Problem) -> None:
    nominal, rubs = fit_of(problem), ("friction.coulomb",)
    tried = (*rubs, "stiffness.quintic", "drive.lag")
    alone, both = (run_residual_tests(fit_of(problem, *those), problem, tried) for those in (rubs, tried[:2]))
    fewer, reduced = drop_unneeded_causes(problem, nominal, both, tried, 0.01)
    assert fewer.hypothesis.mechanisms == rubs
    assert reduced == (nominal,)
    same, reduced = drop_unneeded_causes(problem, nominal, both, tried, 1.0)
    assert same is both, "no smaller set passes"
    assert {one.mechanisms for one in reduced} == {rubs, tried[1:2]}
    assert drop_unneeded_causes(problem, nominal, alone, tried, 0.01) == (alone, (nominal,))


def test_the_worth_of_each_is_a_fit_without_it_taken_from_what_is_known(problem: Problem) -> None:
    nominal, alone = fit_of(problem), fit_of(problem, "stiffness.quintic")
    both = fit_of(problem, "friction.coulomb", "stiffness.quintic")
    rests = {one.mechanisms: one for one in refit_without_each(problem, nominal, both, [alone])}
    assert rests[("stiffness.quintic",)] is alone
    assert rests[("friction.coulomb",)].cost < 0.1 * alone.cost
    assert refit_without_each(problem, nominal, alone) == (nominal,)


def test_what_stays_makes_up_for_what_goes_before_it_is_fitted(problem: Problem) -> None:
    both = fit_hypothesis(
        problem,
        device(
            {"id": "drive.lag", "parameters": {"time_constant": {"value": 1e-3, "unit": "s"}}},
            {"id": "drive.delay", "parameters": {"delay": {"value": 2e-3, "unit": "s"}}},
        ),
        ("drive.lag", "drive.delay"),
        iterations=0,
    )
    assert both is not None
    values = _compensate(problem, both, ("drive.delay",))
    assert values["drive.delay.delay"] == pytest.approx(
        3e-3, rel=0.05
    )  # the lag's millisecond, to first order
    assert "drive.lag.time_constant" not in values
    assert _compensate(problem, both, both.mechanisms) == {}


def test_a_start_that_takes_thousands_of_steps_a_sample_is_none(problem: Problem) -> None:
    """A law of friction that fades within a nanometre per second, beside one within a tenth of a millimetre."""

    def stribeck(speed: float, excess: float = 5e3) -> Simulation:
        values = {
            "level": (450.0, "mm/s^2"),
            "excess": (excess, "mm/s^2"),
            "transition_speed": (speed, "mm/s"),
        }
        parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in values.items()}
        return device({"id": "friction.stribeck", "parameters": parameters})

    assert takes_far_longer(problem, stribeck(1e-4), stribeck(0.1))
    assert takes_far_longer(problem, stribeck(1e-6), stribeck(0.1))  # which no sensible step resolves
    assert not takes_far_longer(problem, stribeck(0.05), stribeck(0.1))
    weak = 1e-4  # of which no transition matters
    assert not takes_far_longer(problem, stribeck(1e-4, weak), stribeck(0.1, weak))
