"""Blind cases of VO2 actuators: a drift, a leak and a transition that lags are named, a sound device is left alone.

The `slow` seeds of 52 thousand were diagnosed wrongly once; no other seed was used to develop the diagnosis.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from case import diagnosed, identified, run_case
from generator import generate

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.search.elimination.backward_elimination import drop_causes_within_allowance
from rtctl.diagnosis.search.model_selection import RankedHypothesis
from rtctl.diagnosis.thresholds import SearchThresholds, Thresholds
from rtctl.wiring_models import mechanism_ids

SMALL: dict[str, Any] = {
    "plant": "vo2",
    "samples": 4000,
    "fit_records": 3,
    "test_records": 1,
    "file_format": "npz",
}


@pytest.mark.parametrize(
    ("seed", "effect"),
    [
        pytest.param(200_600, "sensor.ageing", marks=pytest.mark.slow),
        pytest.param(200_601, "sensor.crosstalk", marks=pytest.mark.slow),
        pytest.param(200_602, "hysteresis.rate_dependence", marks=pytest.mark.slow),
    ],
)
def test_what_ails_the_reading_or_lags_in_it_is_named(seed: int, effect: str) -> None:
    found = run_case(seed, kind="single", effects=(effect,), **SMALL)
    assert found["judgement"] in ("right", "set"), found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [52375, 52454, 52456])
def test_slow_noise_and_a_reading_that_ages_are_told_apart(seed: int) -> None:
    """Of the second and third the gain walks at random, which is in no catalogue."""
    assert run_case(seed, plant="vo2")["judgement"] == "right"


@pytest.mark.slow
def test_nothing_is_claimed_of_a_sound_device() -> None:
    assert run_case(200_610, kind="null", **SMALL)["judgement"] == "right"


@pytest.mark.slow
def test_a_cause_that_removes_less_than_is_allowed_is_not_told(tmp_path: Path) -> None:
    uncorrected = Thresholds(search=SearchThresholds(worth_correcting=np.inf))
    generate(200_600, tmp_path, kind="single", effects=("sensor.ageing",), **SMALL)
    identified(tmp_path)
    found = diagnosed(tmp_path, thresholds=uncorrected)
    data, chosen = replace(found.problem, executor=None), found.search.chosen
    assert chosen.hypothesis.mechanisms == ("sensor.ageing",)
    both = ("sensor.ageing", "hysteresis.shape")
    larger = fit_hypothesis(
        data, chosen.hypothesis.simulation.extended(both[1:]), both, chosen.hypothesis.starts
    )
    assert larger is not None
    of_both = found.search._replace(
        chosen=chosen._replace(hypothesis=larger),
        rankings=(*found.search.rankings, (RankedHypothesis(larger, 0.0),)),
    )
    ids = mechanism_ids("vo2")
    assert drop_causes_within_allowance(data, of_both, ids).chosen.hypothesis.mechanisms == both[:1]
    strict = replace(data, allowed={name: 1e-12 * square for name, square in data.allowed.items()})
    assert drop_causes_within_allowance(strict, of_both, ids).chosen.hypothesis.mechanisms == both
