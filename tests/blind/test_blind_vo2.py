"""Blind cases of VO2 actuators: a drift, a leak and a transition that lags are named, a sound device is left alone.

None of these seeds was used to develop the diagnosis.
"""

from __future__ import annotations

from typing import Any

import pytest
from case import run_case

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
        (200_600, "sensor.ageing"),
        (200_601, "sensor.crosstalk"),
        (200_602, "hysteresis.rate_dependence"),
    ],
)
def test_what_ails_the_reading_or_lags_in_it_is_named(seed: int, effect: str) -> None:
    found = run_case(seed, kind="single", effects=(effect,), **SMALL)
    assert found["judgement"] in ("right", "set"), found


def test_nothing_is_claimed_of_a_sound_device() -> None:
    assert run_case(200_610, kind="null", **SMALL)["judgement"] == "right"
