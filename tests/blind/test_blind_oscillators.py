"""Blind cases of oscillators: the cause that the generator hid is named, from the files alone.

A few small ones; `make slow` runs more, `make blind` hundreds. None of these seeds was used to develop the diagnosis.
"""

from __future__ import annotations

from typing import Any

import pytest
from case import run_case
from judge import judged

SMALL: dict[str, Any] = {"samples": 5000, "fit_records": 3, "test_records": 1, "samples_a_period": 25.0}
NULLS = (
    200_000,
    pytest.param(200_001, marks=pytest.mark.slow),
    pytest.param(200_002, marks=pytest.mark.slow),
)
HIDDEN = (
    pytest.param(200_010, ("friction.coulomb",), marks=pytest.mark.slow),
    pytest.param(200_011, ("stiffness.cubic",), marks=pytest.mark.slow),
    pytest.param(200_012, ("drive.delay",), marks=pytest.mark.slow),
    pytest.param(200_013, ("drive.deadband",), marks=pytest.mark.slow),
    pytest.param(200_014, ("damping.quadratic",), marks=pytest.mark.slow),
    pytest.param(200_015, ("stiffness.parametric",), marks=pytest.mark.slow),
    pytest.param(200_016, ("sensor.hum",), marks=pytest.mark.slow),
    pytest.param(200_017, ("drive.offset",), marks=pytest.mark.slow),
    pytest.param(200_018, ("friction.coulomb", "stiffness.quadratic"), marks=pytest.mark.slow),
)


@pytest.mark.parametrize("seed", NULLS)
def test_nothing_is_claimed_where_nothing_is_hidden(seed: int) -> None:
    found = run_case(seed, kind="null", **SMALL)
    assert found["judgement"] == "right", found


@pytest.mark.parametrize(("seed", "effects"), HIDDEN)
def test_hidden_effects_are_named(seed: int, effects: tuple[str, ...]) -> None:
    kind = "single" if len(effects) == 1 else "pair"
    found = run_case(seed, kind=kind, effects=effects, **SMALL)
    assert found["judgement"] in ("right", "set"), found
    if effects != ("sensor.hum",):  # whose phase in a test record nobody knows
        assert found["test_error_over_noise"] < 1.5, found


@pytest.mark.parametrize(
    ("causes", "expected"),
    [
        ([], "missed"),
        ([("drive.lag", [])], "right"),
        ([("sensor.lag", ["drive.lag"])], "set"),
        ([("sensor.lag", [])], "false"),
        ([("drive.lag", ["sensor.lag", "drive.delay"])], "wide"),
        ([("drive.lag", []), ("sensor.hum", [])], "false"),
    ],
)
def test_a_name_counts_only_if_it_is_the_hidden_one(causes: list[Any], expected: str) -> None:
    line = {
        "kind": "single",
        "truth": ["drive.lag"],
        "equivalent": [],
        "verdict": "explained",
        "causes": [{"id": name, "or": others} for name, others in causes],
    }
    assert judged(line) == expected
