"""Which set is best where none passes, and which smaller one is tested again behind one that does."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.search.elimination.backward_elimination import had_stopped_short
from rtctl.diagnosis.search.leaders import find_almost_passing
from rtctl.diagnosis.thresholds import SearchThresholds

LIMITS = SearchThresholds()


@pytest.mark.parametrize(
    ("p_values", "first"),
    [
        ((1e-225, 1e-4, 0.0), 1),
        ((1e-5, 1e-3, 0.0), None),
        ((1e-225, 1e-30, 0.0), None),
    ],
    ids=["the second all but passes", "the first does as well", "none does"],
)
def test_where_none_passes(p_values: tuple[float, ...], first: int | None) -> None:
    tested: list[Any] = [SimpleNamespace(p_value=value) for value in p_values]
    best = find_almost_passing(tested, LIMITS.almost_passing_p)
    assert best is (None if first is None else tested[first])


@pytest.mark.parametrize(
    ("cost", "asked"),
    [(0.9, True), (0.99995, False), (1.0, False)],
    ids=["much lower", "a little lower", "no lower"],
)
def test_a_smaller_set_is_asked_again_if_it_ends_lower(cost: float, asked: bool) -> None:
    assert had_stopped_short(cost, 1.0, 0.5, LIMITS.improved_share) is asked


@pytest.mark.parametrize(("cost", "asked"), [(0.99995, True), (1.0, False)], ids=["lower", "no lower"])
def test_as_low_as_the_larger_set_a_little_will_do(cost: float, asked: bool) -> None:
    assert had_stopped_short(cost, 1.0, 0.9999, LIMITS.improved_share) is asked
