"""A design's points depend on their numbers alone, and a Latin hypercube has one in every stratum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.campaign.design import Axis, Design, grid_size, permuted

AXES = (Axis("a", "", 2.0, 5.0), Axis("b", "", 1.0, 1000.0, logarithmic=True))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 5000), st.integers(0, 2**31))
def test_a_permutation_takes_every_index_once(size: int, seed: int) -> None:
    found = permuted(np.arange(size), size, (seed, 0))
    assert np.array_equal(np.sort(found), np.arange(size))


@pytest.mark.parametrize("kind", ["random", "latin-hypercube"])
def test_parts_of_a_design_are_the_whole(kind: str) -> None:
    design = Design(kind, AXES, 9000, 3)
    whole = design.points(0, 9000)
    assert np.array_equal(np.concatenate([design.points(0, 4000), design.points(4000, 9000)]), whole)
    assert whole.min(axis=0).tolist() >= [2.0, 1.0]
    assert whole.max(axis=0).tolist() <= [5.0, 1000.0]
    assert not np.array_equal(Design(kind, AXES, 9000, 4).points(0, 9000), whole)


def test_a_latin_hypercube_has_one_point_in_every_stratum_of_every_factor() -> None:
    points = Design("latin-hypercube", AXES, 1000, 5).points(0, 1000)
    shares = np.column_stack([(points[:, 0] - 2.0) / 3.0, np.log(points[:, 1]) / np.log(1000.0)])
    for column in shares.T:
        assert np.array_equal(np.sort(np.floor(column * 1000.0).astype(int)), np.arange(1000))
    assert abs(np.corrcoef(shares.T)[0, 1]) < 4.0 / np.sqrt(1000.0)


def test_a_billion_points_need_no_memory() -> None:
    points = Design("latin-hypercube", AXES, 10**9, 1).points(987_654_000, 987_654_010)
    assert points.shape == (10, 2)


def test_a_grids_last_factor_changes_fastest() -> None:
    axes = (Axis("a", "", 0.0, 1.0, (0.0, 1.0)), Axis("b", "", 5.0, 7.0, (5.0, 6.0, 7.0)))
    assert grid_size(axes) == 6
    assert Design("grid", axes, 6, 0).points(2, 5).tolist() == [[0.0, 7.0], [1.0, 5.0], [1.0, 6.0]]
