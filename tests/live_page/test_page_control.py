"""Changes from the page reach the run through its control socket, with its checks; stop ends it at its safe levels."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from page_cases import SCENARIOS, RecordedLoop, asked, served

from rtctl.border.errors import InputError
from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.none import NoEstimator
from rtctl.live_page.served.server import PageServer
from rtctl.loop.events import Event
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.supervisor import TIMING_COLUMNS, signal_columns
from rtctl.scenario.schema import load_scenario
from rtctl.session.live.control_socket import listening, parameter_units, read_change
from rtctl.session.live.under_way import FOLDER, ONLY_STOP, excitation_under_way
from rtctl.session.run_files import marks_of
from rtctl.session.run_folder import RunFolder, run_metadata


@pytest.fixture
def run(tmp_path: Path) -> Iterator[tuple[PageServer, ParameterChannel]]:
    """A recording with a control socket beside it, and its page."""
    changes = ParameterChannel()
    changes.parameters = lambda: {"controller.kp": 0.02}
    with listening(tmp_path / "steps", changes), served(tmp_path, control=True) as server:
        RecordedLoop(tmp_path / "steps").append(12)
        yield server, changes


def changed(server: PageServer, **request: str) -> tuple[int, str]:
    """Ask for a change as the page does; return status and words."""
    body = json.dumps({"run": "steps", **request})
    status, text, _ = asked(
        server.address, "control", method="POST", body=body, Content_Type="application/json"
    )
    return status, json.loads(text)["said"] if status == 200 else text.strip()


def test_a_set_point_arrives_in_the_unit_of_the_run(run: tuple[PageServer, ParameterChannel]) -> None:
    server, changes = run
    status, said = changed(server, name="setpoint", value="31000 nm")
    assert (status, said) == (200, "setpoint: 11 um -> 31 um from the next step on")
    assert changes.take() == ("setpoint", 31.0)
    assert changed(server, name="setpoint", value="plan")[1].endswith("-> the plan from the next step on")


def test_the_page_is_told_what_can_be_changed_and_its_values(
    run: tuple[PageServer, ParameterChannel],
) -> None:
    server, _ = run
    known = json.loads(asked(server.address, "parameters?run=steps")[1])
    assert known == [
        {"name": "setpoint", "unit": "µm", "value": None},
        {"name": "controller.kp", "unit": "mA/µm", "value": 0.02},
    ]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("controller.kq", "1", "did you mean"), ("setpoint", "nan", "finite"), ("setpoint", "3 kg", "kg"),
        ("setpoint", " ", "setpoint: the field is empty"), ("controller.kp", "0.5", "judged"),
    ],
)  # fmt: skip
def test_what_the_run_refuses_is_refused_in_its_words(
    run: tuple[PageServer, ParameterChannel], name: str, value: str, words: str
) -> None:
    server, changes = run

    def judge(name: str, value: float) -> str:
        raise InputError("judged")

    changes.judge = judge
    status, said = changed(server, name=name, value=value)
    assert (status, words in said) == (409, True), said
    assert not changes


def test_a_run_that_has_gone_is_said(run: tuple[PageServer, ParameterChannel]) -> None:
    server, _ = run
    assert "no run is under way" in changed(server, run="elsewhere", name="stop")[1]


def test_an_excitation_offers_no_change_and_a_played_level_is_in_the_unit_of_the_command(
    tmp_path: Path,
) -> None:
    scenario, tables = load_scenario(SCENARIOS / "acquire_vo2.toml", [])
    columns = signal_columns(scenario.profile, NoEstimator(), PlaybackController("mA"))
    with (
        excitation_under_way(tmp_path / "data", scenario, tables, "levels") as place,
        served(tmp_path, control=True) as server,
    ):
        recording = place.folder.record(columns, TIMING_COLUMNS)
        recording.signals.append((0.0,) * len(columns))
        assert json.loads(asked(server.address, "parameters")[1]) == []
        status, said = changed(server, run="data/acquiring", name="setpoint", value="1")
        assert (status, said) == (409, f"setpoint: {ONLY_STOP}")
        recording.close()
    played = RunFolder(path=tmp_path / "run", metadata=run_metadata(tables), model=None)
    recording = played.record(columns, TIMING_COLUMNS)
    assert parameter_units(tmp_path / "run") == {"setpoint": "mA"}, "no gains, and no um"
    assert read_change(tmp_path / "run", "setpoint=5000 uA").value == 5.0
    recording.close()
    assert (
        marks_of(scenario, [Event(0, "change", {"name": "setpoint", "value": 5.0})])[0].text
        == "setpoint 5 mA"
    )


@pytest.mark.wire
@pytest.mark.slow
def test_stop_ends_an_acquisition_that_is_under_way(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rtctl", "acquire", "acquire_vo2", "--out", str(tmp_path / "data"),
               "--set", "clock.mode=live", "--set", "clock.watchdog=10 s"]  # fmt: skip
    with served(tmp_path, control=True) as server:
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60.0
        while asked(server.address, "history")[0] != 200:  # until its first row is recorded
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert (
            "an excitation is being played"
            in changed(server, run=f"data/{FOLDER}", name="setpoint", value="1")[1]
        )
        assert changed(server, run=f"data/{FOLDER}", name="stop")[0] == 200
        said = process.communicate(timeout=20.0)[1]
    assert f"watch it: rtctl watch {tmp_path / 'data'}" in said
    assert process.returncode == 1
    assert "interrupted: stopped from outside" in said
    assert not (tmp_path / "data" / FOLDER).exists(), "nothing of it stays"
