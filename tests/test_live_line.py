"""A run that records tells how it goes: in a terminal on one line, in a pipe now and then."""

from __future__ import annotations

import gc
import os
import pty
import re
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from rtctl.cli import main
from rtctl.output import live_line as module
from rtctl.output.live_line import clock_text, live_line
from rtctl.recording.layout import Rows
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.recording.tail import Tail


def test_a_tail_reads_each_row_once_while_it_is_written_and_after_the_end(tmp_path: Path) -> None:
    recorder = MappedRecorder(tmp_path / "r.rec", [("a", "um"), ("b", "")], {}, Keeper())
    tail = Tail(tmp_path / "r.rec")
    assert len(tail.new_rows()["a"]) == 0
    seen: list[float] = []
    for count in (1, 2, 700, 3000):
        for _ in range(count):
            recorder.append((float(len(recorder)), 1.0))
        seen += tail.new_rows()["a"].tolist()
    recorder.append((-1.0, 2.0))
    recorder.close()
    last = tail.new_rows()
    assert (last["a"].tolist(), last["b"].tolist()) == ([-1.0], [2.0])
    assert len(tail.new_rows()["a"]) == 0
    assert seen == Rows(tmp_path / "r.rec").table()["a"][:-1].tolist() == np.arange(3703.0).tolist()
    tail.close()


def test_a_tail_leaves_no_file_open_whether_it_was_closed_or_let_go(tmp_path: Path) -> None:
    MappedRecorder(tmp_path / "r.rec", [("a", "um")], {}, Keeper()).close()

    def count() -> int:
        return sum(1 for one in Path("/proc/self/fd").iterdir() if one.resolve() == tmp_path / "r.rec")

    kept = Tail(tmp_path / "r.rec")
    assert count() == 1
    kept.close()
    kept.close()
    Tail(tmp_path / "r.rec")
    gc.collect()
    assert count() == 0


def test_times_read_as_a_clock_does() -> None:
    assert [clock_text(one) for one in (0.4, 61.0, 3723.4)] == ["0:00", "1:01", "1:02:03"]


def test_in_a_pipe_a_line_is_printed_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(module, "EVERY_S", 0.05)
    with live_line("steps", quiet=False) as show:
        show(0.1, "1 s, setpoint 3 um")
        time.sleep(0.06)
        show(0.2, "2 s, setpoint 4 um")
        show(0.3, "3 s, setpoint 5 um")
    assert capfd.readouterr().err == "steps: 20%, 2 s, setpoint 4 um\n"
    with live_line("steps", quiet=True) as show:
        show(1.0, "")
    assert capfd.readouterr() == ("", "")


class Terminal:
    """A terminal that standard error is written to, and what was written."""

    def __init__(self) -> None:
        self._ours, theirs = pty.openpty()
        self.stream = os.fdopen(theirs, "w", encoding="utf-8")
        self._heard = b""
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def _listen(self) -> None:
        with suppress(OSError):  # the other end was closed
            while data := os.read(self._ours, 4096):
                self._heard += data

    def end(self) -> str:
        self.stream.close()
        self._thread.join()
        os.close(self._ours)
        return self._heard.decode()


def test_a_live_run_in_a_terminal_shows_set_point_estimate_error_and_lateness(
    tmp_path: Path, model_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    terminal = Terminal()
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", terminal.stream)
        out = tmp_path / "run"
        command = [
            "run",
            "steps",
            "--model",
            str(model_file),
            "--out",
            str(out),
            "--set",
            "scenario.duration=1.2 s",
        ]
        main([*command, "--set", "clock.mode=live", "--set", "scenario.period=10 ms"])
    shown = terminal.end()
    lines = [line for line in re.split(r"\r\x1b\[K|\r\n", shown) if "setpoint" in line]
    assert len(lines) >= 2
    assert all(len(line) < 80 for line in lines)
    number = r"-?[\d.]+"
    assert re.search(
        rf"setpoint {number}, estimate {number}, error {number} um, late {number} [num]?s$", lines[-1]
    )
    assert shown.endswith("\r\x1b[K"), "the line is gone at the end"
