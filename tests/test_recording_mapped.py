"""A mapped recording: every row arrives, a kill loses none, memory stays constant, the file says what it is."""

from __future__ import annotations

import math
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.recording.layout import PAGE, Rows, read_header
from rtctl.recording.mapped import WINDOW_ROWS, Keeper, MappedRecorder
from rtctl.recording.parquet import write_parquet_parts

COLUMNS = [("index", ""), ("current", "mA"), ("deflection", "um")]
METADATA = {"scenario": 'title = "µ"'}


def recorder_at(path: Path) -> MappedRecorder:
    return MappedRecorder(path, COLUMNS, METADATA, Keeper())


@pytest.mark.parametrize("rows", [0, 1, WINDOW_ROWS - 1, WINDOW_ROWS, WINDOW_ROWS + 1, 5 * WINDOW_ROWS + 7])
def test_every_row_arrives_across_the_borders_of_windows(tmp_path: Path, rows: int) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    for k in range(rows):
        recorder.append((k, 0.1 * k, math.nan if k % 7 == 0 else -0.3 * k))
    found = recorder.close()
    assert len(recorder) == len(found) == rows
    table = found.table()
    np.testing.assert_array_equal(table["index"], np.arange(rows))
    np.testing.assert_array_equal(table["current"], [0.1 * k for k in range(rows)])
    np.testing.assert_array_equal(np.isnan(table["deflection"]), np.arange(rows) % 7 == 0)
    assert (tmp_path / "signals.rec").stat().st_size == PAGE + rows * 32


@pytest.mark.parametrize("row", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, "x")])
def test_a_row_that_does_not_fit_the_columns_is_refused_whole(tmp_path: Path, row: tuple[float, ...]) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    recorder.append((0, 0.0, 0.0))
    with pytest.raises(ValueError, match=f"a row of {len(row)} values for 3 columns"):
        recorder.append(row)
    recorder.append((1, 0.2, -0.6))
    np.testing.assert_array_equal(recorder.close().table()["index"], [0.0, 1.0])


def test_rows_can_be_read_while_they_are_written(tmp_path: Path) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    for k in range(10):
        recorder.append((k, 0.0, 0.0))
    assert len(Rows(tmp_path / "signals.rec")) == 10
    recorder.close()


def test_two_runs_do_not_record_into_one_file(tmp_path: Path) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    recorder.append((1.0, 2.0, 3.0))
    with pytest.raises(InputError, match="another run is recording here"):
        recorder_at(tmp_path / "signals.rec")
    assert len(recorder.close()) == 1


def test_the_header_says_columns_units_and_scenario(tmp_path: Path) -> None:
    recorder_at(tmp_path / "signals.rec").close()
    header = read_header(tmp_path / "signals.rec")
    assert (header.columns, header.metadata, header.begin) == (COLUMNS, METADATA, PAGE)


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "signals.rec"
    path.write_bytes(b"RTCT")
    with pytest.raises(InputError, match="not a recording of rtctl"):
        Rows(path)


def test_the_window_after_next_is_made_by_the_keeper_and_not_by_the_loop(tmp_path: Path) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    for window in range(6):
        deadline = time.monotonic() + 10.0
        while recorder._next is None and time.monotonic() < deadline:
            time.sleep(0.001)
        for k in range(WINDOW_ROWS):
            recorder.append((k, float(window), 0.0))
    assert recorder.waits == 0
    recorder.close()


WRITER = """
import os, sys
from pathlib import Path
from rtctl.recording.mapped import Keeper, MappedRecorder
columns = [(f"c{k}", "") for k in range(19)] + [("last", "")]
recorder = MappedRecorder(Path(sys.argv[1]), columns, {}, Keeper())
k = 0
while True:
    recorder.append((float(k),) * 20)
    k += 1
    if k % 1000 == 0:
        os.write(1, b"%d\\n" % k)
"""


@pytest.mark.parametrize("after", [1, 4, 17])
def test_a_killed_process_loses_no_row_and_leaves_no_half_one(tmp_path: Path, after: int) -> None:
    path = tmp_path / "signals.rec"
    with subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        report = 0
        for _ in range(after):
            report = int(writer.stdout.readline())
        os.kill(writer.pid, signal.SIGKILL)
        report = max([report, *map(int, writer.stdout.read().split())])
    rows = Rows(path)
    assert report <= len(rows) <= report + 1000 + 1
    table = rows.table()
    for name in ("c0", "c11", "last"):
        np.testing.assert_array_equal(table[name], np.arange(len(rows)))


def test_an_hour_at_1_khz_takes_no_more_memory_than_a_minute(tmp_path: Path) -> None:
    """Twenty signals; the rows of an hour are 605 MB. A tenth of it is run here, and what grew is asked."""
    columns = [(f"c{k}", "") for k in range(20)]
    recorder = MappedRecorder(tmp_path / "signals.rec", columns, {}, Keeper())
    row = (0.5,) * 20
    for _ in range(60_000):
        recorder.append(row)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(300_000):
        recorder.append(row)
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert len(recorder.close()) == 360_000
    assert grown_kb < 4096, "a window of 4096 rows has 688 kB, three are mapped at most"


def test_parts_make_the_same_table_as_the_whole(tmp_path: Path) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")
    for k in range(10_000):
        recorder.append((k, 0.1 * k, -0.3 * k))
    table = recorder.close().table()
    write_parquet_parts(tmp_path / "a.parquet", list(table), table.parts(999), dict(COLUMNS), METADATA, "run")
    found = pq.read_table(tmp_path / "a.parquet")
    assert found.num_rows == 10_000
    np.testing.assert_array_equal(found["deflection"].to_numpy(), table["deflection"])
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert {field.name: field.metadata[b"unit"].decode() for field in schema} == dict(COLUMNS)


def test_a_full_disk_is_a_fault_with_the_rows_until_then_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = recorder_at(tmp_path / "signals.rec")

    def full(number: int, offset: int, length: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    for k in range(2 * WINDOW_ROWS):  # the windows that are there already
        recorder.append((k, 0.0, 0.0))
    with pytest.raises(DriverError, match="No space left on device") as caught:
        recorder.append((0.0, 0.0, 0.0))
    assert caught.value.fault is Fault.RECORDING
    assert len(recorder.close()) == 2 * WINDOW_ROWS
