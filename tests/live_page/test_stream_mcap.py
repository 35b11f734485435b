"""An MCAP file has the rows and times of the recording, grows with it, and is whole whenever its writer is killed."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from page_cases import RecordedLoop, asked

from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.live_page.streams.chosen import Streams
from rtctl.live_page.streams.mcap_files import SAVE_EVERY_S, McapRecorder, export_mcap
from rtctl.live_page.watching import watch
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.session.bench.account import Accounted, bench_account
from rtctl.session.live.control_socket import listening

reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")

PAGE = Path(__file__).parents[2] / "docs" / "streams.md"
Messages = dict[str, list[tuple[int, int, dict[str, Any]]]]


def read(file: Path) -> Messages:
    """Return time [ns], number and fields of every message by topic, by the reader of the mcap package."""
    found: Messages = {}
    with file.open("rb") as stream:
        mcap = reader.make_reader(stream, validate_crcs=True)
        assert mcap.get_summary() is not None, "viewers open no file without it"
        for schema, channel, message in mcap.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            content = json.loads(message.data)
            assert content.keys() <= json.loads(schema.data)["properties"].keys()
            found.setdefault(channel.topic, []).append((message.log_time, message.sequence, content))
    return found


def attached(file: Path) -> dict[str, bytes]:
    """Return the files in an MCAP file."""
    with file.open("rb") as stream:
        return {one.name: one.data for one in reader.make_reader(stream).iter_attachments()}


def note(folder: Path, *events: dict[str, Any]) -> None:
    """Append events as a run does."""
    with (folder / "events.jsonl").open("a", encoding="utf-8") as file:
        file.writelines(json.dumps(event) + "\n" for event in events)


def expected(loop: RecordedLoop) -> list[tuple[int, int, dict[str, float]]]:
    """Return the recorded rows as messages: period 1 ms, values that are no numbers left out."""
    table = {name: values.tolist() for name, values in loop.recording.signals.close().table().items()}
    rows = zip(*table.values(), strict=True)
    return [
        (round(1e6 * row[0]), number, {k: v for k, v in zip(table, row, strict=True) if math.isfinite(v)})
        for number, row in enumerate(rows, 1)
    ]


def test_an_exported_run_has_the_same_rows_at_the_same_times(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loop = RecordedLoop(tmp_path / "run")
    loop.append(5)
    loop.append(2000, missed=3)
    (tmp_path / "run" / "summary.json").write_text("{}", encoding="utf-8")
    note(tmp_path / "run", {"step": 2, "event": "change", "name": "controller.kp", "value": 0.5})
    note(tmp_path / "run", {"step": 9, "event": "change", "name": "setpoint", "value": "nan"})
    file = tmp_path / "run.mcap"
    assert main(["export", "mcap", str(tmp_path / "run"), "--out", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 2005
    found = read(file)
    assert found["/signals"] == expected(loop)
    times = [(one[0], one[1]) for one in found["/signals"]]
    assert [(one[0], one[1]) for one in found["/timing"]] == times
    assert found["/timing"][7][2] == {"lateness": 7.0, "round_trip": 20.0, "compute": 3.0}
    assert found["/errors"][0] == (0, 1, {"tracking_error": 0.5, "self_sensing_error": 0.25})
    assert found["/events"][0] == (2_000_000, 0, {"kind": "change", "text": "controller.kp 0.5 mA/um"})
    assert [one[2] for one in found["/parameters"]] == [{"controller.kp": 0.5}] * 2, "the plan is no number"
    files = attached(file)
    assert files.keys() == {"scenario.toml", "summary.json"}
    assert b"1 s steps" in files["scenario.toml"]


def test_the_example_of_the_page_reads_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    RecordedLoop(tmp_path / "run").append(2)
    export_mcap(tmp_path / "run", tmp_path / "steps.mcap")
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "streams.md", "exec"), {})
    assert capsys.readouterr().out == "0.0 0.0 -0.5\n0.001 1.0 0.5\n"


def test_units_stand_in_the_schemas(tmp_path: Path) -> None:
    RecordedLoop(tmp_path / "run").append(1)
    export_mcap(tmp_path / "run", tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as stream:
        summary = reader.make_reader(stream).get_summary()
    fields = {one.name: json.loads(one.data)["properties"] for one in summary.schemas.values()}
    assert fields["rtctl.Signals"]["resistance"]["unit"] == "ohm"
    assert fields["rtctl.Timing"]["lateness"]["unit"] == "us"
    assert fields["rtctl.Parameters"]["controller.ki"]["unit"] == "mA/(um*s)"


def test_a_file_that_grows_has_each_row_once_and_a_second_run_has_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rtctl.live_page.streams.mcap_files.SAVE_EVERY_S", 0.0)
    folder, file = tmp_path / "run", tmp_path / "run.mcap"
    changes = ParameterChannel()
    changes.parameters = lambda: {"controller.kp": 0.02}
    recorder = McapRecorder(folder, file)
    recorder.look()
    assert not file.exists(), "there is no row yet"
    with listening(folder, changes):
        loop = RecordedLoop(folder)
        loop.append(10)
        recorder.look()
        assert len(read(file)["/signals"]) == 10
        assert read(file)["/parameters"] == [(0, 0, {"controller.kp": 0.02})]
        for k in range(3):
            loop.append(700)
            note(folder, {"step": k, "event": "rearmed"})
            recorder.look()
        assert [one[0] for one in read(file)["/events"]] == [0, 1_000_000, 2_000_000], "each event once"
        assert [one[1] for one in read(file)["/signals"]] == list(range(1, 2111))
    loop.append(1)
    loop.end()
    (folder / "summary.json").write_text('{"verdict": "pass"}', encoding="utf-8")
    for _ in range(3):
        recorder.look()
    rows = read(file)["/signals"]
    assert [one[2]["setpoint"] for one in rows] == [float(k) for k in range(2111)]
    assert attached(file)["summary.json"] == b'{"verdict": "pass"}'
    following = RecordedLoop(folder)
    following.append(2)
    monkeypatch.setattr("rtctl.live_page.recorded.followed.PLACES_EVERY_S", 0.0)
    recorder.look()
    recorder.close()
    assert len(read(tmp_path / "run-2.mcap")["/signals"]) == 2
    assert len(read(file)["/signals"]) == 2111
    following.end()


def test_the_account_of_a_served_device_is_exported_without_times(tmp_path: Path) -> None:
    of = Accounted(
        title="x", period_s=1e-4, columns=[("index", ""), ("current", "mA"), ("resistance", "ohm")], inputs=["current"],
        units={"effects.delay": "s"}, judge=lambda name, value: "", values=lambda: {"effects.delay": 0.0},
    )  # fmt: skip
    with bench_account(tmp_path / "bench", of) as account:
        account.row((3.0, 5.0, math.nan))
        account.note(3, "change", "effects.delay", 2e-3)
        account.note(4, "fault", "stall", 0.05)
    assert sorted(os.listdir(tmp_path / "bench")) == ["events.jsonl", "signals.parquet"]
    export_mcap(tmp_path / "bench", tmp_path / "bench.mcap")
    found = read(tmp_path / "bench.mcap")
    assert found["/signals"] == [(300_000, 1, {"index": 3.0, "current": 5.0})]
    assert [one[2]["text"] for one in found["/events"]] == ["effects.delay 2 ms", "stall: for 50 ms"]
    assert found["/parameters"] == [(300_000, 0, {"effects.delay": 2e-3})]
    assert "/timing" not in found
    with bench_account(tmp_path / "nothing", of):
        pass
    assert not (tmp_path / "nothing" / "signals.parquet").exists()


@pytest.mark.wire
def test_what_a_killed_watch_leaves_is_a_whole_file(tmp_path: Path) -> None:
    folder, file = tmp_path / "run", tmp_path / "run.mcap"
    loop = RecordedLoop(folder)
    loop.append(1000)
    command = [sys.executable, "-m", "rtctl", "watch", str(folder), "--port", "0", "--mcap", str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        address, deadline = process.stdout.readline().strip(), time.monotonic() + 20.0
        sizes: set[int] = set()
        while len(sizes) < 3:  # it was written anew twice
            assert time.monotonic() < deadline
            loop.append(20)
            time.sleep(0.02)
            sizes |= {file.stat().st_size} if file.exists() else set()
        assert asked(address)[0] == 200
        size = -1
        # until a save changes nothing: killed in the middle of one, the file would be damaged
        while size != (size := file.stat().st_size):
            assert time.monotonic() < deadline
            time.sleep(1.5 * SAVE_EVERY_S)
        process.send_signal(signal.SIGKILL)
        process.wait(10.0)
    rows = read(file)["/signals"]
    assert len(rows) > 1000
    assert rows == expected(loop)[: len(rows)]


def test_a_full_disk_ends_the_file_and_not_the_watch(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rtctl.live_page.streams.mcap_files.SAVE_EVERY_S", 0.0)
    (tmp_path / "run.mcap").symlink_to("/dev/full")
    RecordedLoop(tmp_path / "run").append(3)
    looks = iter(range(4))
    watch(
        tmp_path / "run", port=0, may_change=False, streams=Streams(mcap=tmp_path / "run.mcap"),
        ready=lambda address: None, stop_requested=lambda: next(looks, None) is None,
    )  # fmt: skip
    said = capsys.readouterr().err
    assert (
        said.count("run.mcap: cannot be written any more: No space left on device; what was saved last stays")
        == 1
    )


@pytest.mark.parametrize(
    ("run", "out", "words"),
    [
        ("missing", "x.mcap", "there is no run"),
        ("empty", "x.mcap", "nothing is recorded there"),
        ("several", "x.mcap", "several runs are recorded below it (a, b); give the folder of one of them"),
        ("several/a", "x.txt", "must end with .mcap"),
        ("several/a", "none/x.mcap", "there is no such folder"),
        ("several/a", "several", "is a folder"),
    ],
)
def test_what_cannot_be_exported_is_said_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], run: str, out: str, words: str
) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("a", "b"):
        RecordedLoop(tmp_path / "several" / name).append(1)
    assert main(["export", "mcap", str(tmp_path / run), "--out", str(tmp_path / out)]) == 2
    assert words in capsys.readouterr().err


def test_without_the_package_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    RecordedLoop(tmp_path / "run").append(1)
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(InputError, match=r"writing \.mcap needs mcap: pip install 'rtctl\[mcap\]'"):
        export_mcap(tmp_path / "run", tmp_path / "run.mcap")
