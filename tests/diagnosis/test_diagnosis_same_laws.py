"""A reading that is early is a late drive: a search fits one of them, and the answer names both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, answer_to, device, measured, noise_drive

from rtctl.diagnosis.report.same_laws import add_same_laws, find_same_laws

IDS = "drive.delay,timing.skew,sensor.offset,damping.quadratic"


def records(late_s: float) -> list[tuple[np.ndarray, np.ndarray, str]]:
    skewed = device({"id": "timing.skew", "parameters": {"late": {"value": late_s, "unit": "s"}}})
    drives = [
        (noise_drive(seed, level), use)
        for seed, level, use in ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
    ]
    return [(drive, measured(skewed, drive), use) for drive, use in drives]


@pytest.mark.parametrize(
    ("periods", "others"),
    [(0.4, ["drive.delay"]), (1.0, []), pytest.param(1.4, [], marks=pytest.mark.slow)],
    ids=["within", "end", "beyond"],
)
def test_rows_that_are_read_late_may_be_read_at_the_end_of_a_period_with_a_late_drive(
    tmp_path: Path, periods: float, others: list[str]
) -> None:
    answer = answer_to(tmp_path, records(periods * PERIOD_S), IDS)
    (cause,) = answer["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("timing.skew", others)
    assert cause["parameters"]["late"]["value"] == pytest.approx(periods * PERIOD_S, rel=0.05)
    assert ("at the end of their period" in cause["statement"]) == bool(others)


def test_rows_that_are_read_early_are_a_late_drive_or_these(tmp_path: Path) -> None:
    answer = answer_to(tmp_path, records(-0.4 * PERIOD_S), IDS)
    (cause,) = answer["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("drive.delay", ["timing.skew"])
    assert cause["parameters"]["delay"]["value"] == pytest.approx(0.4 * PERIOD_S, rel=0.05)


@pytest.mark.slow
def test_where_the_skew_is_not_asked_for_the_delay_stands_alone(tmp_path: Path) -> None:
    (cause,) = answer_to(tmp_path, records(-0.4 * PERIOD_S), "drive.delay,sensor.offset")["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("drive.delay", [])


def test_each_name_is_followed_by_those_of_its_law() -> None:
    same = find_same_laws(device(), ("drive.delay", "timing.skew", "drive.lag"))
    assert same == {"drive.delay": ("timing.skew",)}
    assert add_same_laws(("input.hold",), "drive.delay", same) == ("timing.skew", "input.hold")
    assert add_same_laws(("drive.delay", "input.hold"), "drive.lag", same) == (
        "drive.delay",
        "timing.skew",
        "input.hold",
    )
    assert add_same_laws(("drive.delay",), "timing.skew", same) == ("drive.delay",)
