"""Channels of measurement data files (MDF), converted as the file says. Needs the extra `mdf`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import mdf, open_table

asammdf = pytest.importorskip("asammdf")
from asammdf.blocks.conversion_utils import from_dict  # noqa: E402

T = np.arange(50) / 1000.0
U, X = np.sin(T), np.arange(50)


def write(path: Path, **more: np.ndarray) -> None:
    signals = [
        asammdf.Signal(U, T, unit="V", name="u"),
        asammdf.Signal(X.astype("i2"), T, unit="mm", name="x", conversion=from_dict({"a": 0.5, "b": 3.0})),
    ]
    file = asammdf.MDF(version="4.10")
    file.append(signals, common_timebase=True)
    for values in more.values():
        file.append([asammdf.Signal(values, T[: len(values)], unit="V", name="u")])
    file.save(path, overwrite=True)
    file.close()


@pytest.mark.parametrize("suffix", [".mf4", ".mdf"])
def test_channels_arrive_converted_with_units_and_time(tmp_path: Path, suffix: str) -> None:
    write(tmp_path / "r.mf4")
    path = (tmp_path / "r.mf4").rename(tmp_path / f"r{suffix}")
    assert set(open_table(path).columns) == {"time", "u", "x"}
    cache = TableCache()
    np.testing.assert_array_equal(cache.column(path, "x", "mm"), 0.5 * X + 3.0)
    np.testing.assert_array_equal(cache.column(path, "u", "V", 3, 9), U[3:9])
    np.testing.assert_allclose(cache.column(path, "time", "s"), T)
    with pytest.raises(ValueError, match='the file states unit "mm" for column "x", the manifest "m"'):
        cache.column(path, "x", "m")


def test_channels_of_one_name_go_by_their_group(tmp_path: Path) -> None:
    write(tmp_path / "r.mf4", again=U[:10])
    table = open_table(tmp_path / "r.mf4")
    assert set(table.columns) == {"0/time", "0/u", "x", "1/time", "1/u"}
    assert table.columns["1/u"].shape == (10,)


def test_readings_that_the_file_marks_as_invalid_are_none(tmp_path: Path) -> None:
    path, invalid = tmp_path / "r.mf4", X == 7
    file = asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(U, T, unit="V", name="u", invalidation_bits=invalid)])
    file.save(path)
    file.close()
    np.testing.assert_array_equal(TableCache().column(path, "u", "V"), np.where(invalid, np.nan, U))


def test_what_is_no_such_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "r.mf4").write_bytes(b"%PDF-1.7\n")
    with pytest.raises(ValueError, match="not a measurement data file"):
        mdf.read(tmp_path / "r.mf4")
