"""Whole foreign cases from the command line, each of a kind that was missed before: `make slow`."""

from __future__ import annotations

from pathlib import Path

import foreign_campaign
import pytest


@pytest.mark.slow
@pytest.mark.parametrize(
    ("style", "seed", "effect"),
    [
        ("few_domains", 22, None),
        ("smooth_loop", 22, None),
        ("few_domains", 26, "structure.resonance"),
        ("few_domains", 24, "actuation.delay"),
        ("smooth_loop", 20, "sensor.crosstalk"),
    ],
    ids=[
        "rows read at the end of their periods",
        "loops that are no sum of relays",
        "behind loops that are off by more than the effect",
        "late by less than the missing sample",
        "a fast effect beside a slow error",
    ],
)
def test_a_foreign_case_is_right(style: str, seed: int, effect: str | None, tmp_path: Path) -> None:
    case = foreign_campaign.run_case(style, seed, tmp_path)
    assert case.effect == effect
    assert case.outcome == "right", case


def test_late_readings_of_the_bench_that_are_not_told_from_a_hidden_delay_are_that_delay() -> None:
    late = {"id": "timing.skew", "indistinguishable_from": ["drive.delay"]}
    told = {"verdict": "explained", "causes": [late]}
    assert foreign_campaign.to_be_judged(told, ["timing.skew"])["causes"] == []
    judged = foreign_campaign.to_be_judged(told, ["timing.skew"], ("drive.delay", None))
    assert foreign_campaign.judge("drive.delay", judged, None) == "right"
    assert (
        foreign_campaign.judge(
            "friction.coulomb",
            foreign_campaign.to_be_judged(told, ["timing.skew"], ("friction.coulomb", None)),
            None,
        )
        == "missed"
    )
