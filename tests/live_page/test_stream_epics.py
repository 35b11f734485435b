"""A run as EPICS process variables: an independent client in another process reads it, and writes only what it may."""

from __future__ import annotations

import gc
import json
import math
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_cases import RecordedLoop

from rtctl.border.errors import InputError
from rtctl.live_page.recorded.places import Place
from rtctl.live_page.shown.description import Description
from rtctl.live_page.shown.signals import signals_of
from rtctl.live_page.streams.process_variables import values_of, variables_of
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.scenario.schema import load_scenario
from rtctl.session.live.control_socket import listening

pytest.importorskip("caproto", reason="caproto is not installed")
pytest.importorskip("aioca", reason="aioca is not installed")
from rtctl.live_page.streams.epics import EpicsSender

PREFIX = "LAB:VO2:"
CLIENT = """
import asyncio, json, sys
from aioca import DBR_CHAR_STR, FORMAT_CTRL, caget, caput
async def ask(name):
    if name in ("state", "fault", "message"):
        return str(await caget("LAB:VO2:" + name, datatype=DBR_CHAR_STR, timeout=10))
    answer = await caget("LAB:VO2:" + name, format=FORMAT_CTRL, timeout=10)
    return [float(answer), answer.units, answer.severity]
async def main():
    found = {name: await ask(name) for name in json.loads(sys.argv[1])}
    for name, value in json.loads(sys.argv[2]):
        try:
            await caput("LAB:VO2:" + name, value, wait=True, timeout=10)
            found["put " + name] = "taken"
        except Exception as error:
            found["put " + name] = str(error)
    for name in ("state", "fault", "message"):
        found[name] = await ask(name)
    print(json.dumps(found))
asyncio.run(main())
"""
"""A client by EPICS' own Channel Access library (C), which shares nothing with the server."""


@pytest.fixture(autouse=True)
def port(monkeypatch: pytest.MonkeyPatch) -> int:
    """A port of this test's own for server and clients, on this machine only."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        number: int = free.getsockname()[1]
    monkeypatch.setenv("EPICS_CA_SERVER_PORT", str(number))
    monkeypatch.setenv("EPICS_CA_ADDR_LIST", "127.0.0.1")
    monkeypatch.setenv("EPICS_CA_AUTO_ADDR_LIST", "NO")
    monkeypatch.delenv("EPICS_CAS_INTF_ADDR_LIST", raising=False)
    return number


def asked(look: Callable[[], object], names: list[str], puts: list[tuple[str, float]]) -> dict[str, Any]:
    """Let a client read and write while the server looks for new rows; return what it has found."""
    command = [sys.executable, "-c", CLIENT, json.dumps(names), json.dumps(puts)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as client:
        deadline = time.monotonic() + 30.0
        while client.poll() is None:
            assert time.monotonic() < deadline
            look()
            time.sleep(0.02)
        out, said = client.communicate()
    assert client.returncode == 0, said
    found: dict[str, Any] = json.loads(out)
    return found


@pytest.mark.wire
def test_a_client_reads_the_run_and_sets_it_with_the_checks_of_the_run(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    changes = ParameterChannel()
    changes.parameters = lambda: {"controller.kp": 0.02}

    def judge(name: str, value: float) -> str:
        if value > 60.0:
            raise InputError("setpoint = 99 um: the model reaches 3 um to 60 um")
        return ""

    changes.judge = judge
    names = ["setpoint", "estimate", "deflection", "error", "self_sensing_error", "resistance", "current"]
    names += ["surrogate", "kp", "ki", "faults", "sample", "time"]
    with listening(tmp_path, changes):
        loop = RecordedLoop(tmp_path)
        loop.append(10)
        fault = {"step": 4, "event": "fault", "fault": "no_answer", "message": "nothing came"}
        (tmp_path / "events.jsonl").write_text(json.dumps(fault) + "\n", encoding="utf-8")
        sender = EpicsSender(tmp_path, PREFIX, may_change=True)
        puts = [("setpoint", 99.0), ("kp", 0.03), ("estimate", 1.0), ("setpoint", 31.0)]
        try:
            sender.look()
            found = asked(sender.look, names, puts)
        finally:
            sender.close()
    assert found["setpoint"] == [9.0, "um", 0]
    assert [found[name][0] for name in names[1:7]] == [8.75, 8.5, 0.5, 0.25, 49991.0, 7.009]
    assert found["surrogate"][2] == 3, "what is no number is an alarm: INVALID"
    assert found["ki"][1:] == ["mA/um/s", 3], "the run does not tell its value"
    assert found["kp"] == [0.02, "mA/um", 0]
    assert [found[name][0] for name in ("faults", "sample", "time")] == pytest.approx([1.0, 10.0, 9e-3])
    assert (found["state"], found["fault"]) == ("recording", "no_answer: nothing came")
    assert "access denied" in found["put estimate"]
    assert found["put setpoint"] == "taken", "the second one"
    assert [changes.take(), changes.take()] == [("controller.kp", 0.03), ("setpoint", 31.0)]
    assert not changes, "the refused one never reached the loop"
    assert found["message"].startswith("setpoint: 9 um -> 31 um from the next step on")
    assert capfd.readouterr() == ("", "")


@pytest.mark.wire
def test_without_control_nothing_can_be_written(tmp_path: Path) -> None:
    changes = ParameterChannel()
    with listening(tmp_path, changes):
        RecordedLoop(tmp_path).append(10)
        sender = EpicsSender(tmp_path, PREFIX, may_change=False)
        try:
            sender.look()
            found = asked(sender.look, ["setpoint"], [("setpoint", 31.0)])
        finally:
            sender.close()
    assert "access denied" in found["put setpoint"]
    assert not changes


def test_a_run_with_several_outputs_has_all_of_them() -> None:
    scenario, _ = load_scenario(Path(__file__).parents[2] / "scenarios" / "vo2_mirror_steps.toml", [])
    columns = [
        ("setpoint", "mrad"),
        ("estimate", "mrad"),
        ("surrogate", ""),
        ("estimate_standard_error", "mrad"),
    ]
    columns += [(scenario.profile.reference.name, "mrad"), ("height", "um")]
    columns += [(f"{word}_{name}", unit) for name, unit in (("tilt", "mrad"), ("height", "um"))
                for word in ("setpoint", "estimate")]  # fmt: skip
    shown = signals_of(columns, scenario)

    class Rows:
        def __init__(self) -> None:
            self.columns = columns
            self.metadata: dict[str, str] = {}

    description = Description(
        rows=Rows(), place=Place("x", Path()), scenario=scenario, remark="", period_s=1e-3, shown=shown  # type: ignore[arg-type]
    )  # fmt: skip
    units = {one.name: one.unit for one in variables_of(description)}
    assert (units["error_tilt"], units["error_height"], units["error"]) == ("mrad", "um", "mrad")
    table = {name: np.array([float(k)]) for k, (name, _) in enumerate(columns)}
    values = values_of(description, table)
    assert values["error_height"] == values["setpoint_height"] - values["height"]
    assert values["error_tilt"] == values["setpoint_tilt"] - values["estimate_tilt"], "nothing reads it"
    assert all(math.isfinite(one) for one in values.values())


def test_an_address_of_another_machine_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EPICS_CAS_INTF_ADDR_LIST", "203.0.113.7")
    with pytest.raises(InputError, match=r"EPICS_CAS_INTF_ADDR_LIST = 203.0.113.7: .* no address of this"):
        EpicsSender(tmp_path, PREFIX, may_change=False)


@pytest.mark.parametrize("prefix", ["", "LAB VO2:", "LÄB:", "a.b"])
def test_a_prefix_that_is_none_is_refused_in_words(tmp_path: Path, prefix: str) -> None:
    with pytest.raises(InputError, match="such as LAB:VO2:"):
        EpicsSender(tmp_path, prefix, may_change=False)


@pytest.mark.wire
def test_a_server_beside_another_one_takes_another_port_and_leaves_no_socket_open(
    tmp_path: Path, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    left_open: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda said: left_open.append(said.exc_value))
    RecordedLoop(tmp_path)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as other:
        other.bind(("127.0.0.1", port))
        other.listen()
        EpicsSender(tmp_path, PREFIX, may_change=False).close()
    gc.collect()
    assert left_open == []
