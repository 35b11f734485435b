"""A run that is killed leaves its rows; recovered it has all files of a run, and a replay gives the same commands."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from wire_cases import settings, signals_of, summary_of

from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.loop.events import read_events
from rtctl.recording.layout import Rows
from rtctl.session.recovery import _timing

SCENARIO = "me_amplitude"


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take most of a short run's time."""
    monkeypatch.setattr("rtctl.session.run_files.draw_run", lambda path, scenario, result: None)


@contextmanager
def running(folder: Path, *options: str) -> Iterator[subprocess.Popen[bytes]]:
    """`rtctl run` in a process of its own, past its first thousand samples."""
    command = [sys.executable, "-m", "rtctl", "run", SCENARIO, "--out", str(folder), "--quiet", *options]
    with subprocess.Popen(command, start_new_session=True) as process:
        try:
            while process.poll() is None and rows_in(folder) < 1000:
                time.sleep(0.02)
            yield process
        finally:
            process.kill()


def rows_in(folder: Path) -> int:
    """Whole rows until now."""
    try:
        return len(Rows(folder / "signals.rec"))
    except (OSError, InputError):
        return 0


def replayed(folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, object]]:
    capsys.readouterr()
    code = main(["replay", str(folder), "--json"])
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return code, found


def test_nothing_is_lost_when_the_process_is_killed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    with running(folder, *settings("scenario.duration=200 s")) as process:
        before = rows_in(folder)
        assert main(["recover", str(folder), "--quiet"]) == 2, "not while it runs"
        assert "a run is recording here" in capsys.readouterr().err
        os.kill(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    assert not (folder / "summary.json").exists()
    assert rows_in(folder) >= before
    code, found = replayed(folder, capsys)
    assert (code, found["identical"]) == (0, True), "a recording can be replayed before it is recovered"
    assert main(["recover", str(folder), "--quiet"]) == 0
    signals, summary = signals_of(folder), summary_of(folder)
    assert len(signals["index"]) == summary["timing"]["steps"] >= before
    np.testing.assert_array_equal(signals["index"], np.arange(len(signals["index"])))
    assert summary["verdict"] == "fault"
    assert [fault["fault"] for fault in summary["faults"]] == ["killed"]
    assert not (folder / "signals.rec").exists()
    assert replayed(folder, capsys) == (code, found)
    assert main(["recover", str(folder), "--quiet"]) == 2
    assert "no interrupted recording" in capsys.readouterr().err


def test_a_sample_counts_whose_times_were_not_written_any_more() -> None:
    times = {"lateness": np.full(4, 7.0), "round_trip": np.full(4, 200.0), "compute": np.full(4, 20.0)}
    found = _timing(times, steps=5, overruns=2)
    assert (found.steps, found.overruns) == (5, 2)
    assert found.lateness.summary_us()["max"] == pytest.approx(7.0, rel=0.05)


def test_a_running_loop_is_changed_from_outside_and_a_replay_makes_the_same_change(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    with running(folder, *settings("scenario.duration=200 s")) as process:
        for change in ("setpoint=0.7 um", "setpoint=plan", "setpoint=0.5"):
            assert main(["set", str(folder), change, "--quiet"]) == 0
        for change, words in (
            ("setpoint=2 V", "not compatible with um"),
            ("setpiont=1", 'did you mean "setpoint"'),
        ):
            assert main(["set", str(folder), change]) == 2
            assert words in capsys.readouterr().err
        before = rows_in(folder)
        while process.poll() is None and rows_in(folder) < before + 500:
            time.sleep(0.02)
        process.terminate()
        assert process.wait() == 1
    assert main(["set", str(folder), "setpoint=1"]) == 2
    assert "no run is under way here" in capsys.readouterr().err
    changes = [event for event in read_events(folder / "events.jsonl") if event.kind == "change"]
    assert [event.values["name"] for event in changes] == 3 * ["setpoint"]
    assert [event.values["value"] for event in changes] == pytest.approx([0.7, math.nan, 0.5], nan_ok=True)
    signals = signals_of(folder)
    assert (signals["setpoint"][changes[-1].step :] == 0.5).all()
    assert replayed(folder, capsys)[1]["identical"] is True


def short_run(folder: Path, *options: str) -> int:
    return main(
        ["run", SCENARIO, "--out", str(folder), "--quiet", *settings("scenario.duration=0.3 s", *options)]
    )


def test_a_new_run_does_not_write_over_what_a_killed_one_has_left(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    short_run(folder)
    left = left_by_a_kill(folder)
    short_run(folder)
    assert (folder / "interrupted-1" / "signals.rec").read_bytes() == left
    assert (folder / "interrupted-1" / "model.toml").is_file()
    assert (folder / "summary.json").is_file()


def left_by_a_kill(folder: Path) -> bytes:
    """A file as a kill leaves it."""
    from rtctl.recording.mapped import Keeper, MappedRecorder

    recorder = MappedRecorder(folder / "signals.rec", [("index", "")], {}, Keeper())
    recorder.append((1.0,))
    recorder.close()
    return (folder / "signals.rec").read_bytes()


def test_a_replay_says_where_it_differs_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "run"
    short_run(folder)
    assert replayed(folder, capsys)[1]["identical"] is True
    path = folder / "signals.parquet"
    table = pq.read_table(path)
    column = table.schema.get_field_index("quadrature")
    readings = table["quadrature"].to_numpy().copy()
    readings[100] = readings[100] * (1.0 + 1e-12)
    changed = table.set_column(column, table.schema.field(column), pa.array(readings))
    pq.write_table(changed, path)
    code, found = replayed(folder, capsys)
    assert code == 1
    first = found["first_difference"]
    assert isinstance(first, dict)
    assert first["index"] == 100, "the estimate of the sample whose reading is another by 1e-12"


def test_a_live_run_replays_to_the_bit_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Readings are a period old there, and periods may be missed."""
    folder = tmp_path / "run"
    short_run(folder, "clock.mode=live", "scenario.period=2 ms", "clock.timeout=5 s", "clock.watchdog=10 s")
    code, found = replayed(folder, capsys)
    assert (code, found["identical"]) == (0, True)
    timing = summary_of(folder)["timing"]
    assert found["rows"] == timing["steps"] > 0
    assert timing["steps"] + timing["overruns"] == 150
    assert {request["name"] for request in timing["requests"]} >= {"garbage collection frozen"}


def test_a_replay_needs_the_folder_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(tmp_path)]) == 2
    assert "the folder of a run that has ended is needed" in capsys.readouterr().err


def test_a_new_run_does_not_write_over_a_finished_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ["run", SCENARIO, "--out", str(tmp_path), "--set", "scenario.duration=0.8 s"]
    assert main([*short, "--set", "driver.seed=1"]) in (0, 1)
    first, events = signals_of(tmp_path), (tmp_path / "events.jsonl").read_text()
    capsys.readouterr()
    (tmp_path / "retuned-1.toml").write_text("# took over")
    assert main([*short, "--set", "driver.seed=2"]) in (0, 1)
    assert f"{tmp_path} held a run: it is now in {tmp_path / 'before-1'}" in capsys.readouterr().err
    kept = signals_of(tmp_path / "before-1")
    np.testing.assert_array_equal(kept["amplitude"], first["amplitude"])
    assert (tmp_path / "before-1" / "events.jsonl").read_text() == events
    assert (tmp_path / "before-1" / "retuned-1.toml").read_text() == "# took over"  # a replay needs it
    assert not (tmp_path / "retuned-1.toml").exists()
    assert not np.array_equal(signals_of(tmp_path)["amplitude"], first["amplitude"])
