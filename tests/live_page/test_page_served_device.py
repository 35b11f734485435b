"""`rtctl serve --page --faults`: a Modbus client meets faults, the page shows and changes what the plant does."""

from __future__ import annotations

import json
import math
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq
import pytest
from page_cases import asked, viewer
from pymodbus.client import ModbusTcpClient

from drivers.served_line import ServedLine
from plant_sim.bench.device import BenchDevice
from plant_sim.bench.under_way import Bench
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.scenario.serving import LASTING, ServedFault, read_faults
from rtctl.session.bench.account import Accounted, bench_account
from rtctl.wiring import build_device

PATIENCE_S = 30.0
CURRENT, READING, IDENTITY = 0, 100, 120


class Served(NamedTuple):
    """A served device."""

    process: subprocess.Popen[str]
    page: str
    client: ModbusTcpClient
    folder: Path


@pytest.fixture
def device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    """The real server with a page, and a client that is not ours."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    folder = tmp_path / "really"
    command = [sys.executable, "-m", "rtctl", "serve", "vo2_a", "--modbus-tcp", "127.0.0.1:0", "--page", "0",
               "--record", str(folder), "--faults", "frozen_value at=0s duration=300ms"]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        page = process.stdout.readline().split()[1]
        port = int(process.stdout.readline().split()[2].rpartition(":")[2])
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=5.0)
        assert client.connect()
        client.write_registers(3, [1])
        try:
            yield Served(process, page, client, folder)
        finally:
            client.close()
            process.terminate()
            process.wait(PATIENCE_S)


def exchanged(client: ModbusTcpClient, current_mA: float, sequence: int) -> tuple[float, float]:
    """Command a current; return resistance [ohm] and reference deflection [um] as the client gets them."""
    words = [*struct.unpack(">HH", struct.pack(">f", current_mA)), sequence]
    found = client.readwrite_registers(
        read_address=READING, read_count=10, write_address=CURRENT, values=words
    ).registers
    return tuple(struct.unpack(">f", struct.pack(">HH", *found[k : k + 2]))[0] for k in (0, 7))  # type: ignore[return-value]


def changed(page: str, name: str, value: str, **headers: str) -> tuple[int, str]:
    """Ask for a change as the page does; return status and words."""
    body = json.dumps({"run": ".", "name": name, "value": value})
    status, text, _ = asked(
        page, "control", method="POST", body=body, Content_Type="application/json", **headers
    )
    return status, json.loads(text)["said"] if status == 200 else text.strip()


def sensed_until(served: Served, sequence: int, wanted: bool) -> int:
    """Exchange until the resistance is a number or not, as wanted; return the last sequence number."""
    deadline = time.monotonic() + PATIENCE_S
    while math.isfinite(exchanged(served.client, 6.0, sequence)[0]) != wanted:
        assert time.monotonic() < deadline
        sequence += 1
        time.sleep(0.01)
    return sequence


@pytest.mark.wire
def test_a_client_meets_the_faults_and_the_page_shows_and_changes_what_the_plant_really_does(
    device: Served,
) -> None:
    begun_s, readings = time.monotonic(), [exchanged(device.client, 3.0, 1)]
    while (newest := exchanged(device.client, 6.0, 2))[0] == readings[0][0]:
        readings.append(newest)
        assert time.monotonic() - begun_s < 5.0
    assert time.monotonic() - begun_s > 0.29, "the resistance is frozen from the first command on"
    frozen = readings[1:] or [newest]  # a machine that stalls gives one reading only
    assert frozen[-1][1] < readings[0][1] - 1.0, "the plant has moved meanwhile"

    known = {one["name"]: one for one in json.loads(asked(device.page, "parameters")[1])}
    assert known["effects.delay"] == {"name": "effects.delay", "unit": "s", "value": 0.0}
    assert known["fault.sensor_fault"]["unit"] == "s"
    assert changed(device.page, "effects.delay", "20 ms") == (
        200,
        "effects.delay: 0 s -> 20 ms from the next step on",
    )
    status, said = changed(device.page, "fault.stall", "50 ms")
    assert (status, said) == (200, "fault.stall: 50 ms; it strikes the next bytes on the line")
    assert duration_until(device.client, 0.045) > 0.045, "an answer is held back"
    assert changed(device.page, "fault.sensor_fault", "200 ms")[0] == 200
    sequence = sensed_until(device, sensed_until(device, 201, False), True)
    for name, value, words in (
        ("effects.delay", "2 s", "effects: key"), ("fault.stal", "1 s", "did you mean"), ("fault.stall", "1 kg", "kg"),
    ):  # fmt: skip
        status, said = changed(device.page, name, value)
        assert (status, words in said) == (409, True), said

    elsewhere = device.page.replace(device.page.split("/")[3], "another")
    assert asked(elsewhere, "parameters")[0] == 403, "without the token"
    assert changed(device.page, "fault.stall", "1 s", Origin="http://elsewhere.example")[0] == 403
    assert changed(device.page, "fault.stall", "1 s", Host="elsewhere.example")[0] == 403

    with viewer(device.page) as events:
        run = next(one.content for one in events if one.kind == "run")
    assert run["title"] == "VO2-A: what it really does"
    assert run["remark"] == ""
    assert [one["name"] for one in run["signals"][:3]] == ["current", "true_deflection", "true_resistance"]

    assert changed(device.page, "stop", "")[0] == 200
    deadline = time.monotonic() + PATIENCE_S
    while not status_of(device.client) & 2:
        assert time.monotonic() < deadline
    device.client.close()
    device.process.send_signal(signal.SIGTERM)
    assert device.process.wait(PATIENCE_S) == 0
    check_account(device.folder, sequence)


def duration_until(client: ModbusTcpClient, long_s: float) -> float:
    """Exchange until an exchange lasts long [s]; return how long."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        begun_s = time.monotonic()
        exchanged(client, 8.0, 200)
        lasted_s = time.monotonic() - begun_s
        if lasted_s > long_s or time.monotonic() > deadline:
            return lasted_s


def status_of(client: ModbusTcpClient) -> int:
    """Return register 104."""
    return int(client.read_holding_registers(104, count=1).registers[0])


def check_account(folder: Path, sequence: int) -> None:
    """The account has what the plant did through all of it, and what was done to it."""
    assert sorted(os.listdir(folder)) == ["events.jsonl", "signals.parquet"]
    table = pq.read_table(folder / "signals.parquet")
    found = {name: table[name].to_numpy() for name in table.column_names}
    assert np.all(np.diff(found["index"]) > 0)
    assert np.all(np.isfinite(found["true_resistance"]))
    lost = np.isnan(found["resistance"]) & (
        found["index"] > found["index"][np.isfinite(found["resistance"])][0]
    )
    assert lost.any(), "what the host was told, not what is true"
    assert found["line_faults"][-1] == 1
    assert not np.array_equal(found["current"], found["acting_current"]), "the delay acts"
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [one.get("fault", one.get("name")) for one in events] == [
        "frozen_value", "effects.delay", "stall", "sensor_fault", "stop",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--faults", "bit_flip rate=0.1"], "none of a TCP connection"),
        pytest.param(["--page", "70000"], "--page 70000: cannot be used", marks=pytest.mark.slow),
        (["--page", "0", "--record", "/dev/null/x"], "Not a directory"),
    ],
)
def test_what_is_wrong_is_said_without_a_traceback(
    capfd: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    assert main(["serve", "vo2_a", "--modbus-tcp", "127.0.0.1:0", *words]) in (1, 2)
    said = capfd.readouterr().err
    assert message in said
    assert "Traceback" not in said


OF = Accounted(
    title="x", period_s=1e-4, columns=[("index", ""), ("current", "mA")], inputs=[], units={},
    judge=lambda name, value: "", values=dict,
)  # fmt: skip


def test_an_account_takes_no_folder_that_is_in_use_and_moves_a_killed_one_aside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    busy, killed = tmp_path / "busy", tmp_path / "killed"
    killed.mkdir()
    with bench_account(busy, OF) as account:
        account.row((0.0, 5.0))
        with pytest.raises(InputError, match="a run is recording here"), bench_account(busy, OF):
            pass
        shutil.copy(busy / "signals.rec", killed)
    assert main(["recover", str(killed)]) == 2
    assert "rtctl export mcap makes a file of it" in capsys.readouterr().err
    with bench_account(killed, OF):
        pass
    assert "is now in" in capsys.readouterr().err
    assert (killed / "interrupted-1" / "signals.rec").is_file()


def test_faults_of_a_share_of_the_bursts_are_few_events_that_count_all_of_them(tmp_path: Path) -> None:
    now_s = [0.0]
    plant = build_device("vo2_a", tmp_path, 1)
    bench = Bench(
        BenchDevice(plant, lambda: now_s[0], is_inspected=False), ServedLine([("drop", 0.5, 0.0, None)])
    )
    with bench_account(tmp_path, OF) as account:
        bench.note = account.note
        for seconds in range(25):
            for _ in range(40):
                bench.line.to_device(b"request", float(seconds))
            now_s[0] += 1.0
            bench.look()
        bench.apply("fault.stall", 0.05)
        bench.line.to_host(b"answer", 25.0)
        bench.tell_of_chance(0.0)
    events = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert [one["fault"] for one in events] == ["drop", "drop", "drop", "stall", "drop"], (
        "a stall was asked for"
    )
    told = [one for one in events if one["fault"] == "drop"]
    assert sum(one["count"] for one in told) == bench.line.injected - 1
    assert re.fullmatch(r"\d+ bursts of bytes struck by chance", told[0]["message"])
    assert told[-1]["message"].endswith(f"struck by chance, {bench.line.injected - 1} so far")
    assert bench.line.injected > 400


def test_an_account_that_finds_no_room_ends_and_is_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, before[1]))
    try:
        with bench_account(tmp_path, OF) as account:
            for k in range(20_000):
                account.row((float(k), 5.0))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert capsys.readouterr().err.count("the device goes on without its account") == 1
    index = pq.read_table(tmp_path / "signals.parquet")["index"].to_pylist()
    assert 4096 < len(index) < 20_000
    assert index == list(range(len(index)))


def test_the_page_of_the_documentation_has_every_kind_of_fault_and_its_file_is_one(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "serve.md").read_text(encoding="utf-8")
    table = page.split("| kind | of |")[1].split("\n\n")[0]
    kinds = ServedFault.model_json_schema()["properties"]["kind"]["enum"]
    assert set(re.findall(r"`(\w+)`", table)) == set(kinds)
    rows = [row for row in table.splitlines() if row.endswith("| needed |")]
    assert set(re.findall(r"`(\w+)`", "".join(rows))) == set(LASTING)
    (example,) = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    file = tmp_path / "faults.toml"
    file.write_text(example, encoding="utf-8")
    assert [one.kind for one in read_faults(str(file), on_tcp=True).faults] == ["delay", "sensor_fault"]
    (spec,) = re.findall(r'--faults "([^"]+ms)"', page)
    assert len(read_faults(spec, on_tcp=True).faults) == 2
