"""Recordings: every row arrives, the bytes repeat, units and scenario travel in the file."""

from __future__ import annotations

import hashlib
import math
import os
import stat
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from rtctl.output.atomic_write import replacing
from rtctl.recording import CHUNK_ROWS, Recorder, write_parquet

COLUMNS = [("index", ""), ("current", "mA"), ("deflection", "um")]


def recorded(rows: int) -> Recorder:
    recorder = Recorder(COLUMNS)
    for k in range(rows):
        recorder.append((k, 0.1 * k, math.nan if k % 7 == 0 else -0.3 * k))
    return recorder


@pytest.mark.parametrize("rows", [0, 1, CHUNK_ROWS - 1, CHUNK_ROWS, CHUNK_ROWS + 1, 3 * CHUNK_ROWS])
def test_every_row_arrives_across_the_borders_of_chunks(rows: int) -> None:
    recorder = recorded(rows)
    table = recorder.table()
    assert len(recorder) == rows
    np.testing.assert_array_equal(table["index"], np.arange(rows))
    np.testing.assert_array_equal(table["current"], [0.1 * k for k in range(rows)])
    np.testing.assert_array_equal(np.isnan(table["deflection"]), np.arange(rows) % 7 == 0)


def test_recording_goes_on_after_a_look_at_the_table() -> None:
    recorder = recorded(10)
    before = recorder.table()
    recorder.append((10, 1.0, 2.0))
    assert len(before["index"]) == 10
    assert recorder.table()["index"][-1] == 10.0


@pytest.mark.parametrize("row", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, "x")])
def test_a_row_that_does_not_fit_the_columns_is_refused_whole(row: tuple[float, ...]) -> None:
    recorder = recorded(2)
    with pytest.raises(ValueError, match=f"a row of {len(row)} values for 3 columns"):
        recorder.append(row)
    recorder.append((2, 0.2, -0.6))
    np.testing.assert_array_equal(recorder.table()["index"], [0.0, 1.0, 2.0])


@pytest.mark.parametrize("columns", [[], [("a", ""), ("a", "mA")]])
def test_columns_need_different_names(columns: list[tuple[str, str]]) -> None:
    with pytest.raises(ValueError, match="column names must differ"):
        Recorder(columns)


def test_a_file_states_units_and_the_scenario(tmp_path: Path) -> None:
    recorded(5).write(tmp_path / "run" / "signals.parquet", {"scenario": 'title = "µ"'})
    schema = pq.read_schema(tmp_path / "run" / "signals.parquet")
    assert {field.name: field.metadata[b"unit"].decode() for field in schema} == dict(COLUMNS)
    assert schema.metadata[b"scenario"].decode() == 'title = "µ"'


def test_identical_rows_give_identical_bytes(tmp_path: Path) -> None:
    digests = set()
    for name in ("a.parquet", "b.parquet"):
        recorded(10_000).write(tmp_path / name, {"scenario": "s"})
        digests.add(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
    assert len(digests) == 1


def test_a_loop_that_is_interrupted_still_leaves_what_was_recorded(tmp_path: Path) -> None:
    recorder = Recorder(COLUMNS)

    def run() -> None:
        try:
            for k in range(100):
                if k == 42:
                    raise KeyboardInterrupt
                recorder.append((k, 0.0, 0.0))
        finally:
            recorder.write(tmp_path / "signals.parquet", {})

    with pytest.raises(KeyboardInterrupt):
        run()
    assert pq.read_table(tmp_path / "signals.parquet").num_rows == 42


def test_a_write_that_breaks_keeps_the_file_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "signals.parquet"
    recorded(3).write(path, {})
    with pytest.raises(ValueError, match="could not convert"):
        write_parquet(path, {"a": np.array(["text"])}, {}, {}, "run")  # type: ignore[dict-item]
    assert pq.read_table(path).num_rows == 3
    assert [entry.name for entry in tmp_path.iterdir()] == ["signals.parquet"]


def test_a_failure_half_way_leaves_the_old_file_and_no_partial_one(tmp_path: Path) -> None:
    path = tmp_path / "new" / "signals.parquet"
    with replacing(path) as partial:
        partial.write_text("old")

    def half() -> None:
        with replacing(path) as partial:
            partial.write_text("ha")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        half()
    assert path.read_text() == "old"
    assert [entry.name for entry in path.parent.iterdir()] == ["signals.parquet"]


def test_the_contents_are_on_the_disk_before_the_name_and_the_name_before_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, calls = tmp_path / "summary.json", []
    fsync, rename = os.fsync, os.replace

    def noted_fsync(descriptor: int) -> None:
        calls.append(("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file", path.exists()))
        fsync(descriptor)

    def noted_rename(source: Path, target: Path) -> None:
        calls.append(("rename", path.exists()))
        rename(source, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_rename)
    with replacing(path) as partial:
        partial.write_text("{}")
    assert calls == [("file", False), ("rename", False), ("folder", True)]


def test_two_writers_of_one_path_do_not_mix(tmp_path: Path) -> None:
    path = tmp_path / ("long name " * 25)[:250]
    with replacing(path) as first, replacing(path) as second:
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first", "the last one to end"
    assert list(tmp_path.iterdir()) == [path]
