"""Decimation leaves out only what nobody could see."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.plots.elements.decimation import LINE_POINTS, PLANE_POINTS, extremes, path_points, visited


@given(count=st.integers(1, 3000), points=st.integers(8, 400), seed=st.integers(0, 2**32 - 1))
def test_extremes_are_bounded_ascending_and_keep_ends_and_extremes(
    count: int, points: int, seed: int
) -> None:
    values = np.random.default_rng(seed).standard_normal(count)
    kept = extremes(values, points)
    assert len(kept) <= max(points, min(count, points))
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert values[kept].max() == values.max()
    assert values[kept].min() == values.min()


def test_a_single_spike_among_sixty_thousand_samples_is_drawn() -> None:
    values = np.zeros(60_000)
    values[41_337] = 1.0
    assert 41_337 in extremes(values)
    assert len(extremes(values)) <= LINE_POINTS


def test_a_gap_longer_than_a_bucket_stays_a_gap() -> None:
    values = np.ones(60_000)
    values[20_000:30_000] = np.nan
    kept = extremes(values)
    inside = (kept >= 20_100) & (kept < 29_900)
    assert inside.any()
    assert np.isnan(values[kept][inside]).all()


def test_short_columns_are_kept_whole() -> None:
    values = np.arange(50.0)
    assert np.array_equal(extremes(values), np.arange(50))
    assert np.array_equal(visited(values, values), np.arange(50))


def test_visited_is_bounded_finite_and_spans_the_plane() -> None:
    draw = np.random.default_rng(0)
    x, y = draw.standard_normal(60_000), draw.standard_normal(60_000)
    x[::7] = np.nan
    kept = visited(x, y)
    assert 1000 < len(kept) <= PLANE_POINTS
    assert np.isfinite(x[kept]).all()
    for values in (x, y):
        finite = values[np.isfinite(x)]
        assert np.ptp(values[kept]) > 0.95 * np.ptp(finite)


def test_visited_keeps_one_point_of_a_plant_at_rest() -> None:
    assert len(visited(np.full(60_000, 6.5), np.full(60_000, 30.0))) == 1


@pytest.mark.parametrize("count", [10, 60_000])
def test_a_path_keeps_the_extremes_of_every_column(count: int) -> None:
    columns = np.random.default_rng(1).standard_normal((2, count))
    kept = path_points(*columns)
    assert len(kept) <= 2 * LINE_POINTS
    for column in columns:
        assert column[kept].max() == column.max()
