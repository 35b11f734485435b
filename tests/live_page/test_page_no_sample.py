"""A run without a sample is not waited for once nobody is there to take one: page, terminal and the verbs say so."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from page_cases import RecordedLoop, served, viewer

from rtctl.border.errors import InputError
from rtctl.live_page.recorded.followed import FollowedRun
from rtctl.live_page.watching import first_words
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.recording import write_parquet
from rtctl.session.live.control_socket import is_listened_to, listening
from rtctl.session.recovery import recover
from rtctl.session.replay import read_run

KILLED = (
    "import os, signal, sys; from pathlib import Path; from page_cases import RecordedLoop\n"
    "from rtctl.loop.live_parameters import ParameterChannel\n"
    "from rtctl.session.live.control_socket import listening\n"
    "with listening(Path(sys.argv[1]), ParameterChannel()):\n"
    "    loop = RecordedLoop(Path(sys.argv[1])) if sys.argv[2] == 'recording' else None\n"
    "    os.kill(os.getpid(), signal.SIGKILL)"
)


def killed_before_its_first_sample(folder: Path, when: str) -> None:
    """Leave in `folder` what a run leaves that was killed `when` "recording" or still "opening" its device."""
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", KILLED, str(folder), when]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=False)
    assert done.returncode == -signal.SIGKILL
    assert (folder / "control.sock").is_socket()
    assert (folder / "signals.rec").is_file() == (when == "recording")


@pytest.mark.parametrize("when", ["recording", "opening"])
def test_a_run_killed_before_its_first_sample_is_not_waited_for(tmp_path: Path, when: str) -> None:
    killed_before_its_first_sample(tmp_path / "run", when)
    run = FollowedRun(tmp_path)
    assert not run.look()
    assert run.state() == "killed"
    with served(tmp_path) as server, viewer(server.address) as events:
        state = next(one for one in events if one.kind == "state").content
    assert (state["state"], state["summary"]) == ("killed", None)
    assert "before its first sample; nothing was recorded" in state["words"]
    assert "before its first sample" in first_words(tmp_path)
    with listening(tmp_path / "run", ParameterChannel()):
        assert run.state() == "waiting", "the next run has begun to open its device"
    run.close()


def test_the_verbs_that_read_a_run_say_that_it_has_no_sample(tmp_path: Path) -> None:
    killed_before_its_first_sample(tmp_path, "recording")
    for read in (read_run, recover):
        with pytest.raises(InputError, match="killed before its first sample; nothing was recorded"):
            read(tmp_path)


def test_the_rows_of_an_earlier_run_do_not_stand_for_one_without_a_sample(tmp_path: Path) -> None:
    first = RecordedLoop(tmp_path)
    first.append(5)
    run = FollowedRun(tmp_path)
    assert run.look()
    assert not run.has_no_row()
    first.end()
    assert not run.look()
    second = RecordedLoop(tmp_path)
    assert not run.look()
    assert run.state() == "waiting", "it records, and has no sample yet"
    second.recording.close()
    assert run.state() == "killed"
    assert run.has_no_row()
    run.close()


def test_a_run_that_ended_without_a_sample_shows_its_verdict(tmp_path: Path) -> None:
    write_parquet(tmp_path / "signals.parquet", {}, {}, {"program": "rtctl"}, "run")
    (tmp_path / "summary.json").write_text(
        '{"verdict": "fault", "tracking": {}, "self_sensing": {}, "checks": [], "timing": {"overruns": 0}, '
        '"faults": [{"fault": "timeout", "message": "no answer"}]}',
        encoding="utf-8",
    )
    with served(tmp_path) as server, viewer(server.address) as events:
        state = next(one for one in events if one.kind == "state").content
    assert state["state"] == "ended"
    assert "there is no sample to show" in state["words"]
    assert state["summary"]["lines"] == ["fault: timeout: no answer"]


def test_an_empty_folder_is_waited_for(tmp_path: Path) -> None:
    assert is_listened_to(tmp_path) is None
    run = FollowedRun(tmp_path)
    assert not run.look()
    assert run.state() == "waiting"
    assert "nothing is recorded there yet" in first_words(tmp_path)
    loop = RecordedLoop(tmp_path)
    assert first_words(tmp_path) == "", "a recording that has begun needs no words"
    loop.append(1)
    assert first_words(tmp_path) == ""
    loop.end()
