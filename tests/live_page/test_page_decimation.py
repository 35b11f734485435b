"""Bins have the smallest and largest number of their rows, however long the recording is."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.live_page.recorded import decimation
from rtctl.live_page.recorded.decimation import Pyramid


def numbers(rows: int, seed: int) -> np.ndarray:
    draw = np.random.default_rng(seed)
    values = draw.normal(size=(2, rows))
    values[0, draw.random(rows) < 0.2] = np.nan
    return values


@settings(max_examples=60, deadline=None)
@given(
    rows=st.integers(1, 4000), seed=st.integers(0, 99), bins=st.integers(1, 12) | st.integers(1, 300),
    ends=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0) | st.just(1.0)),
)  # fmt: skip
def test_bins_tell_the_extremes_of_their_rows(
    rows: int, seed: int, bins: int, ends: tuple[float, float]
) -> None:
    values = numbers(rows, seed)
    first, last = (round(rows * end) for end in sorted(ends))

    def read(begin: int, end: int) -> np.ndarray:
        return values[:, begin:end]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decimation, "MOST_BLOCKS", 8)  # so that blocks are merged several times
        patch.setattr(decimation, "FIRST_BLOCK_ROWS", 16)
        patch.setattr(decimation, "ROWS_OF_A_READ", 50)
        pyramid = Pyramid(2)
        for count in (rows // 3, rows):
            pyramid.extend(count, read)
        found = pyramid.range(first, last, bins, read)
    assert len(found.first) <= bins
    if first == last:
        assert len(found.first) == 0
        return
    assert found.first[0] <= first < last <= found.last
    borders = [*found.first.tolist(), found.last]
    for k, (begin, end) in enumerate(pairwise(borders)):
        assert begin < end
        part = values[:, begin:end]
        assert np.array_equal(found.low[:, k], np.fmin.reduce(part, axis=1), equal_nan=True)
        assert np.array_equal(found.high[:, k], np.fmax.reduce(part, axis=1), equal_nan=True)


def test_memory_does_not_grow_with_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decimation, "MOST_BLOCKS", 16)
    monkeypatch.setattr(decimation, "FIRST_BLOCK_ROWS", 2)
    values = np.arange(10_000.0).reshape(1, -1)
    pyramid = Pyramid(1)
    pyramid.extend(10_000, lambda begin, end: values[:, begin:end])
    assert pyramid._low.shape == (1, 16)
    assert pyramid.block_rows == 1024
    found = pyramid.range(0, 10_000, 4, lambda begin, end: values[:, begin:end])
    assert found.low[0, 0] == 0.0
    assert found.high[0, -1] == 9999.0, "rows that are no whole block yet are in the last bin"
