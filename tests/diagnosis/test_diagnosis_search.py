"""Which set goes first where none passes: one that all but passes before those that the gate refutes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.search import _all_but_passing


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
    examined: list[Any] = [SimpleNamespace(p_value=value) for value in p_values]
    found = _all_but_passing(examined)
    assert found is (None if first is None else examined[first])
