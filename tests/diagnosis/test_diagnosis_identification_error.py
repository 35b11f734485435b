"""What corrects the identified loops beside other causes is the identification's error, not an effect of the device."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.report.causes import separate_corrections
from rtctl.diagnosis.result import Cause
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.simulations.vo2.mechanisms import MECHANISMS

LAGS = ("hysteresis.rate_dependence", 0.9, ())


def cause(identity: str, share: float, others: tuple[str, ...] = ()) -> Cause:
    return Cause(
        id=identity, statement="", kind="mechanism", probability=0.9, parameters={}, share_removed=share,
        indistinguishable_from=others,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ([LAGS, ("hysteresis.shape", 0.03, ())], ["hysteresis.rate_dependence"]),
        ([LAGS, ("thermal.latent_heat", 0.03, ("hysteresis.shape",))], ["hysteresis.rate_dependence"]),
        ([LAGS, ("thermal.latent_heat", 0.03, ())], ["hysteresis.rate_dependence", "thermal.latent_heat"]),
        ([LAGS, ("hysteresis.shape", 0.3, ())], ["hysteresis.rate_dependence", "hysteresis.shape"]),
        ([("hysteresis.shape", 0.03, ())], ["hysteresis.shape"]),
    ],
    ids=["small", "not told from it", "another", "large", "alone"],
)
def test_a_small_correction_of_the_loops_is_told_only_where_nothing_else_is(
    given: list[tuple[str, float, tuple[str, ...]]], named: list[str]
) -> None:
    sets = [[name for name, _, _ in given], *([other] for _, _, others in given for other in others)]
    simulations: list[Any] = [
        SimpleNamespace(mechanisms=[MECHANISMS[name] for name in names]) for names in sets
    ]
    left, corrected = separate_corrections([cause(*one) for one in given], simulations, ReportThresholds())
    assert [one.id for one in left] == named
    assert corrected == tuple(name for name, _, _ in given if name not in named)
