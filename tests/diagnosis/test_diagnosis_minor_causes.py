"""A small cause beside an unknown rest that is larger is not named."""

from __future__ import annotations

from test_diagnosis_holdout_support import ASYMMETRIC, FRICTION, IDS, OFFSET_MM, fit_of, record_of

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without_each
from rtctl.diagnosis.search.holdout_support import drop_minor
from rtctl.diagnosis.search.model_selection import rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.identification.scales import estimate_scales

BOTH = {"friction.coulomb", "sensor.offset"}


def left_of(*effects: dict[str, object], passes: bool = False) -> tuple[set[str], tuple[str, ...]]:
    """What stays of friction and an offset, fitted to a device with an offset and `effects`, and what is dropped."""
    records = tuple(record_of(seed, OFFSET_MM, effects) for seed in (1, 2))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = run_residual_tests(fit_of(problem), problem, IDS)
    both = run_residual_tests(fit_of(problem, "friction.coulomb", "sensor.offset"), problem, IDS)
    without = refit_without_each(problem, nominal.hypothesis, both.hypothesis)
    fields = ([fit_of(problem, "friction.coulomb")], [both.hypothesis])
    tried = tuple(rank_hypotheses(problem, one, both, plain=not passes) for one in fields)
    found = SearchResult(nominal, both, passes, (), tried, without)
    result, dropped = drop_minor(found, problem, [record_of(7, OFFSET_MM, effects)], IDS)
    return set(result.chosen.hypothesis.mechanisms), dropped


def test_what_removes_less_than_is_left_is_dropped_and_the_largest_stays() -> None:
    assert left_of(FRICTION, ASYMMETRIC) == ({"friction.coulomb"}, ("sensor.offset",))


def test_beside_noise_nothing_is_dropped() -> None:
    assert left_of(FRICTION) == (BOTH, ())


def test_of_a_set_that_explains_all_nothing_is_dropped() -> None:
    assert left_of(FRICTION, ASYMMETRIC, passes=True) == (BOTH, ())
