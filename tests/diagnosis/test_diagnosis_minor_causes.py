"""Beside an unknown rest that is larger a small cause is not named, nor a second law of dissipation."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, cause, device, noise_drive
from test_diagnosis_holdout_support import ASYMMETRIC, FRICTION, IDS, OFFSET_MM, fit_of, record_of

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without_each
from rtctl.diagnosis.search.elimination.dissipation import drop_imitating_dissipation
from rtctl.diagnosis.search.elimination.holdout_support import drop_minor
from rtctl.diagnosis.search.model_selection import rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

BOTH = {"friction.coulomb", "sensor.offset"}


def searched(
    *effects: dict[str, object], causes: tuple[str, ...], passes: bool = False
) -> tuple[SearchResult, Problem]:
    """An outcome with `causes`, fitted to two records of a device with an offset and `effects`."""
    records = tuple(record_of(seed, OFFSET_MM, effects) for seed in (1, 2))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = run_residual_tests(fit_of(problem), problem, IDS)
    chosen = run_residual_tests(fit_of(problem, *causes), problem, IDS)
    without = refit_without_each(problem, nominal.hypothesis, chosen.hypothesis)
    fields = ([fit_of(problem, causes[0])], *([chosen.hypothesis] for _ in causes[1:]))
    tried = tuple(rank_hypotheses(problem, one, chosen, plain=not passes) for one in fields)
    return SearchResult(nominal, chosen, passes, (), tried, without), problem


def left_of(*effects: dict[str, object], passes: bool = False) -> tuple[set[str], tuple[str, ...]]:
    """What stays of friction and an offset, and what is dropped."""
    found, problem = searched(*effects, causes=("friction.coulomb", "sensor.offset"), passes=passes)
    result, dropped = drop_minor(found, problem, [record_of(7, OFFSET_MM, effects)], IDS)
    return set(result.chosen.hypothesis.mechanisms), dropped


def test_what_removes_less_than_is_left_is_dropped_and_the_largest_stays() -> None:
    assert left_of(FRICTION, ASYMMETRIC) == ({"friction.coulomb"}, ("sensor.offset",))


def test_beside_noise_nothing_is_dropped() -> None:
    assert left_of(FRICTION) == (BOTH, ())


def test_of_a_set_that_explains_all_nothing_is_dropped() -> None:
    assert left_of(FRICTION, ASYMMETRIC, passes=True) == (BOTH, ())


POWER = cause("damping.power", level=(300.0, "mm/s^2"), speed=(30.0, "mm/s"), exponent=(0.7, "1"))
FALLING = cause(
    "friction.stribeck", level=(60.0, "mm/s^2"), excess=(300.0, "mm/s^2"), transition_speed=(8.0, "mm/s")
)


@pytest.mark.parametrize(
    ("hidden", "pair", "dropped"),
    [
        ((FRICTION, POWER, ASYMMETRIC), ("friction.coulomb", "damping.power"), ()),
        ((FALLING,), ("friction.coulomb", "damping.quadratic"), ("damping.quadratic",)),
    ],
)
def test_two_laws_of_dissipation_that_imitate_a_third_are_told_from_two_that_are_there(
    hidden: tuple[dict[str, object], ...], pair: tuple[str, ...], dropped: tuple[str, ...]
) -> None:
    """The two that are there stand beside an unknown rest, which keeps the set from passing."""
    found, problem = searched(*hidden, causes=(*pair, "sensor.offset"))
    result, others = drop_imitating_dissipation(found, problem, IDS, WorkBudget.of(np.inf))
    assert others == dropped
    assert set(result.chosen.hypothesis.mechanisms) == {*pair, "sensor.offset"} - set(dropped)


def test_of_a_set_that_explains_all_no_law_of_dissipation_is_dropped() -> None:
    found, problem = searched(FALLING, causes=("friction.coulomb", "damping.quadratic"), passes=True)
    assert drop_imitating_dissipation(found, problem, IDS, WorkBudget.of(np.inf)) == (found, ())


@pytest.mark.parametrize(("error", "numerical"), [(1e-8, True), (1e-4, False)])
def test_in_readings_without_noise_the_error_of_an_integration_is_no_finding(
    error: float, numerical: bool
) -> None:
    """A smooth error of a ten-millionth is what simulated hardware leaves; of a thousandth of a percent, it is none."""
    drive = noise_drive(3)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    plant = device()
    clean = plant.predict(stimulus, np.array([one.value for one in plant.parameters])).outputs[
        "displacement"
    ][0]
    slow = 1.0 + error * np.sin(np.arange(len(clean)) / 300.0)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": clean * slow}, first=1),)
    problem = Problem(subject=subject_of("oscillator"), records=records, scales=estimate_scales(records))
    tested = run_residual_tests(fit_of(problem), problem, IDS)
    assert (tested.p_value == 1.0) == numerical
