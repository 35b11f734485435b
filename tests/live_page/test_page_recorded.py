"""A watcher reads the same rows under the same numbers while a run grows, when it has ended, after a kill."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from page_cases import RecordedLoop

from rtctl.border.errors import InputError
from rtctl.live_page.recorded.followed import FILES_WITHIN_S, FollowedRun
from rtctl.live_page.recorded.places import is_recording, newest_of, places_in
from rtctl.live_page.recorded.rows import ParquetRows
from rtctl.measured.dataset import Record
from rtctl.measured.writer import write_dataset
from rtctl.recording.parquet import write_parquet_parts


def test_the_rows_of_a_run_keep_their_numbers_when_they_become_parquet(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path)
    run = FollowedRun(tmp_path)
    assert not run.look(), "before the first row there is nothing to follow"
    assert run.state() == "waiting"
    loop.append(700)
    assert run.look()
    assert run.rows is not None
    key, before = run.rows.key, run.rows.read(100, 110)
    assert run.state() == "recording"
    loop.append(300)
    assert not run.look(), "the same recording, longer"
    assert run.rows.count() == 1000
    loop.end()
    assert not run.look(), "the same recording in another file"
    assert run.rows.key == key
    assert (run.state(), run.rows.count()) == ("ended", 1000)
    after = run.rows.read(100, 110)
    assert {name: values.tolist() for name, values in after.items() if name != "surrogate"} == {
        name: values.tolist() for name, values in before.items() if name != "surrogate"
    }
    run.close()


@pytest.mark.parametrize("seen_ended", [False, True])
def test_another_run_in_the_same_folder_is_another_recording(tmp_path: Path, seen_ended: bool) -> None:
    first = RecordedLoop(tmp_path)
    first.append(50)
    run = FollowedRun(tmp_path)
    assert run.look()
    first.end()
    if seen_ended:
        assert not run.look()
        assert run.state() == "ended"
    second = RecordedLoop(tmp_path, begin=5.0)
    assert not run.look(), "it has no row yet; the Parquet file of the first one is still there"
    second.append(10)
    assert run.look()
    assert run.state() == "recording"
    assert run.rows is not None
    assert run.rows.count() == 10
    second.end()
    run.close()


def test_a_killed_run_is_told_from_one_that_writes_its_files(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys; from pathlib import Path; from page_cases import RecordedLoop\n"
        "loop = RecordedLoop(Path(sys.argv[1])); loop.append(40); os.kill(os.getpid(), signal.SIGKILL)"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], env={**os.environ, "PYTHONPATH": path}, check=False
    )
    assert done.returncode == -signal.SIGKILL
    run = FollowedRun(tmp_path)
    assert run.look()
    assert run.rows is not None
    assert (run.state(), run.rows.count()) == ("ending", 40)
    run.close()
    long_ago = os.stat(tmp_path / "signals.rec").st_mtime - 2.0 * FILES_WITHIN_S
    os.utime(tmp_path / "signals.rec", (long_ago, long_ago))
    again = FollowedRun(tmp_path)
    assert again.look()
    assert again.state() == "killed"
    again.close()


def test_whether_a_run_is_under_way_is_seen_without_taking_its_lock(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path / "a")
    assert is_recording(tmp_path / "a" / "signals.rec")
    assert not is_recording(tmp_path / "a" / "events.jsonl")
    loop.append(1)
    loop.recording.close()
    assert not is_recording(tmp_path / "a" / "signals.rec")


def test_runs_of_a_demonstration_are_found_and_the_one_under_way_is_the_newest(tmp_path: Path) -> None:
    old = RecordedLoop(tmp_path / "steps")
    old.append(3)
    under_way = RecordedLoop(tmp_path / "dataset" / "acquiring")
    under_way.append(3)
    last = RecordedLoop(tmp_path / "a_later_one")
    last.append(3)
    old.end()
    last.end()
    places = places_in(tmp_path)
    assert [place.name for place in places] == ["a_later_one", "dataset/acquiring", "steps"]
    newest = newest_of(places)
    assert newest is not None
    assert newest.name == "dataset/acquiring"
    under_way.end()
    assert newest_of([]) is None


def test_a_parquet_file_is_read_across_the_borders_of_its_row_groups(tmp_path: Path) -> None:
    path, values = tmp_path / "signals.parquet", np.arange(300.0)
    parts = [{"index": values[k : k + 100]} for k in (0, 100, 200)]
    write_parquet_parts(path, ["index"], parts, {"index": ""}, {"program": "rtctl"}, "run")
    rows = ParquetRows(path)
    for first, last in ((0, 300), (99, 101), (100, 200), (150, 260), (299, 300), (5, 5)):
        assert rows.read(first, last)["index"].tolist() == values[first:last].tolist(), (first, last)
    rows.close()


def test_a_file_that_is_no_parquet_file_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "signals.parquet").write_bytes(b"PAR0 not at all")
    with pytest.raises(InputError, match="cannot be read as Parquet"):
        ParquetRows(tmp_path / "signals.parquet")
    assert not FollowedRun(tmp_path).look()


def test_the_records_of_a_dataset_are_rows_too(tmp_path: Path) -> None:
    signals = {"drive": np.arange(5.0), "displacement": np.arange(5.0) ** 2}
    records = [Record(name=name, period_s=0.5, signals=signals) for name in ("one", "two")]
    write_dataset(
        tmp_path, name="two records", plant="oscillator", identity="", records=records,
        units={"drive": "V", "displacement": "um"}, holds={"drive": "zero"}, metadata={},
    )  # fmt: skip
    assert [place.name for place in places_in(tmp_path)] == ["one", "two"]
    newest = newest_of(places_in(tmp_path))
    assert newest is not None
    assert newest.name == "two", "the records stand in the order in which they were taken"
    run = FollowedRun(tmp_path, "two")
    assert run.look()
    assert run.rows is not None
    assert run.rows.metadata["title"] == "two records: two"
    assert run.rows.read(2, 4)["displacement"].tolist() == [4.0, 9.0]
    assert run.state() == "ended"
    run.close()
    under_way = RecordedLoop(tmp_path / "acquiring")
    under_way.append(1)
    newest = newest_of(places_in(tmp_path))
    assert newest is not None
    assert newest.name == "acquiring", "an excitation is being recorded"
    under_way.end()
