"""A mechanism that the set's own parameters nearly imitate starts where these have made room for it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rtctl.diagnosis.projection import Rows, project
from rtctl.diagnosis.runners import _given_way
from rtctl.identification.residual_noise import NoiseModel

SAMPLES = 500


def way_of(apart: float, step: float = 2.0) -> np.ndarray:
    """Of two own parameters, for a direction that is 3 times the second and `apart` something of its own."""
    rng = np.random.default_rng(0)
    shared, own = rng.standard_normal((2, 1, SAMPLES)), rng.standard_normal((1, 1, SAMPLES))
    rows = Rows(
        residual=rng.standard_normal((1, SAMPLES)), shared=shared, own=np.zeros((0, 1, SAMPLES)),
        directions=3.0 * shared[1:] + apart * own,
    )  # fmt: skip
    projected = project([rows], [NoiseModel(np.empty(0), 1.0)])
    parent: Any = SimpleNamespace(projected=projected, hypothesis=SimpleNamespace(shared=np.zeros(2)))
    return _given_way(parent, [0], np.array([step]))


def test_they_take_back_what_it_adds_along_them() -> None:
    assert way_of(0.1) == pytest.approx([0.0, -6.0], abs=0.05)


@pytest.mark.parametrize("apart", [3.0, 1e-5])
def test_they_stay_where_it_has_a_sign_of_its_own_or_none_at_all(apart: float) -> None:
    assert way_of(apart) == pytest.approx([0.0, 0.0], abs=1e-12)
