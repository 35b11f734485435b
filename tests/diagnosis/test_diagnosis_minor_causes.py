"""A small cause beside an unknown rest that is larger is not named."""

from __future__ import annotations

import pytest
from test_diagnosis_holdout_support import ASYMMETRIC, FRICTION, IDS, OFFSET_MM, fit_of, record_of

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without_each
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.verification.minor_causes import list_minor_causes
from rtctl.identification.scales import estimate_scales


def minor_of(*effects: dict[str, object], passes: bool = False) -> tuple[str, ...]:
    """Minor causes of friction and an offset, fitted to a device with an offset and `effects`."""
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
    found = SearchResult(nominal, both, passes, (), (), without)
    return list_minor_causes(found, problem, [record_of(7, OFFSET_MM, effects)])


def test_what_removes_less_than_is_left_is_minor() -> None:
    assert minor_of(FRICTION, ASYMMETRIC) == ("sensor.offset",)


def test_beside_noise_nothing_is_minor() -> None:
    assert minor_of(FRICTION) == ()


@pytest.mark.parametrize("effects", [(FRICTION, ASYMMETRIC)])
def test_of_a_set_that_explains_all_nothing_is_minor(effects: tuple[dict[str, object], ...]) -> None:
    assert minor_of(*effects, passes=True) == ()
