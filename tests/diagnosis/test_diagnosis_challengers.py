"""Rivals of a single cause that was found late, or when time was out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.search.challengers import list_unfinished
from rtctl.diagnosis.thresholds import Thresholds

PROBLEM: Any = SimpleNamespace(thresholds=Thresholds())


def hypothesis(*mechanisms: str, cost: float = 1.0) -> Any:
    return SimpleNamespace(mechanisms=mechanisms, cost=cost)


def found(chosen: Any, *tried: list[Any], equivalent: tuple[Any, ...] = ()) -> Any:
    rankings = tuple(tuple(SimpleNamespace(hypothesis=one) for one in size) for size in tried)
    nominal = SimpleNamespace(hypothesis=hypothesis(cost=100.0))
    return SimpleNamespace(
        nominal=nominal, chosen=SimpleNamespace(hypothesis=chosen), rankings=rankings, equivalent=equivalent
    )


def test_single_causes_that_may_yet_end_as_low_stand_beside_the_best() -> None:
    delay, lag, hold = hypothesis("delay"), hypothesis("lag", cost=2.5), hypothesis("hold", cost=30.0)
    assert list_unfinished(PROBLEM, found(delay, [delay, lag, hold])) == (lag,)
    assert list_unfinished(PROBLEM, found(delay, [delay, lag, hold], equivalent=(lag,))) == (lag,)


@pytest.mark.parametrize("pairs", [[], [hypothesis("delay", "cubic")]])
def test_where_larger_sets_were_fitted_single_ones_had_ended(pairs: list[Any]) -> None:
    delay, lag = hypothesis("delay"), hypothesis("lag", cost=2.5)
    chosen = pairs[0] if pairs else delay
    assert list_unfinished(PROBLEM, found(chosen, [delay, lag], pairs)) == ()
