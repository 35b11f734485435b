"""A run of a device that is slower than the hold before its first sample says so: every model starts at rest."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from vo2_cases import SCENARIOS

from rtctl.scenario.schema import load_scenario
from rtctl.session.rest import begins_too_early


class Film(NamedTuple):
    """What is asked of a model."""

    time_constant_s: float


@pytest.mark.parametrize(("settle", "is_told"), [("50 ms", True), ("299 ms", True), ("300 ms", False)])
def test_a_short_hold_before_the_first_sample_is_told(settle: str, is_told: bool) -> None:
    scenario, _ = load_scenario(SCENARIOS / "steps.toml", [f"clock.settle={settle}"])
    said = begins_too_early(scenario, Film(0.06))
    assert bool(said) is is_told
    if is_told:
        assert 'the time constant of the model is 60 ms; --set clock.settle="600 ms"' in said


def test_a_model_without_a_time_constant_is_not_judged() -> None:
    scenario, _ = load_scenario(SCENARIOS / "steps.toml", [])
    assert begins_too_early(scenario, object()) == ""
    assert begins_too_early(scenario, Film(1.8e-3)) == ""
