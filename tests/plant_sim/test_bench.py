"""Faults of a served device on purpose: each does what its name says at its time, on the real server and its wires."""

from __future__ import annotations

import asyncio
import math
import os
import struct
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from recording_plant import ManualClock, RecordingPlant

from drivers.served_line import ServedLine
from plant_sim.bench.device import BenchDevice, DeviceFault
from plant_sim.bench.under_way import Bench, PlannedFault
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires, served
from rtctl.border.errors import Fault, InputError
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.scenario.serving import OF_DEVICE, ServedFault, read_faults

PERIOD_US = 1000


def device(clock: Callable[[], float] | None = None) -> BenchDevice:
    """Return a device in lockstep, armed; or free-running on `clock`."""
    made = BenchDevice(RecordingPlant(), clock or ManualClock())
    if clock is None:
        made.set_clock(lockstep=True, period_us=PERIOD_US)
    made.set_enable(True)
    return made


def samples(of: BenchDevice, count: int, first: int = 1) -> list[Measurement]:
    """Return so many exchanges."""
    return [of.exchange((2.0,), first + k) for k in range(count)]


def test_a_reading_freezes_for_its_time_and_the_plant_goes_on() -> None:
    made = device()
    made.plan(3e-3, lambda: made.strike(DeviceFault.FROZEN_VALUE, 2.5e-3))
    made.plan(7e-3, lambda: made.strike(DeviceFault.FROZEN_VALUE, 1.5e-3))
    found = [one.sensed[0] - 1000.0 for one in samples(made, 10)]
    expected = [2e-3, 4e-3, 6e-3, 8e-3, 8e-3, 8e-3, 14e-3, 16e-3, 16e-3, 20e-3]
    assert found == pytest.approx(expected, abs=1e-4)


def test_a_sensor_fails_for_its_time_and_says_so() -> None:
    made = device()
    made.plan(2e-3, lambda: made.strike(DeviceFault.SENSOR_FAULT, 2e-3))
    found = samples(made, 6)
    assert [math.isnan(one.sensed[0]) for one in found] == [False, False, True, True, False, False]
    assert [bool(one.status & DeviceStatus.SENSOR_FAULT) for one in found] == [
        math.isnan(one.sensed[0]) for one in found
    ]


def test_a_counter_freezes_for_its_time() -> None:
    made = device()
    made.plan(1e-3, lambda: made.strike(DeviceFault.FROZEN_COUNTER, 2e-3))
    assert [one.counter for one in samples(made, 5)] == [1, 2, 2, 4, 5]


def test_a_watchdog_that_trips_takes_the_safe_levels_until_the_device_is_armed_again() -> None:
    clock = ManualClock()
    made = device(clock)
    made.exchange((2.0,), 1)
    made.strike(DeviceFault.WATCHDOG_TRIPPED, 0.0)
    clock.now_s += 0.01
    found = made.exchange((3.0,), 2)
    assert found.status == DeviceStatus.ENABLED | DeviceStatus.WATCHDOG_TRIPPED | DeviceStatus.REFUSED
    assert made._plant.levels[-1] == 0.5
    made.set_enable(False)
    made.set_enable(True)
    assert made.exchange((3.0,), 3).status == DeviceStatus.ENABLED


def test_a_device_that_is_switched_off_says_so() -> None:
    made = device()
    made.strike(DeviceFault.NOT_ENABLED, 0.0)
    assert not made.exchange((2.0,), 1).status & DeviceStatus.ENABLED


def test_the_account_has_what_was_commanded_and_read_and_goes_on_through_a_restart() -> None:
    clock = ManualClock()
    made = device(clock)
    rows: list[tuple[float, ...]] = []
    made.account = rows.append
    assert [name for name, _ in made.columns] == [
        "index", "current", "resistance", "deflection", "line_faults", "device_status",
    ]  # fmt: skip
    assert dict(made.columns)["line_faults"] == "count", "fractions beside it would lie flat"
    made.live()
    assert math.isnan(rows[-1][2]), "nobody has read yet"
    for k in range(3):
        clock.now_s += 0.01
        made.exchange((2.0 + k,), k + 1)
    clock.now_s += 0.01
    made.power_cycle()
    clock.now_s += 0.02
    made.live()
    made.live()
    assert [row[0] for row in rows] == [0.0, 100.0, 200.0, 300.0, 600.0], "one row for one time"
    assert [row[1] for row in rows] == [0.0, 2.0, 3.0, 4.0, 0.0]
    assert rows[2][2] == pytest.approx(1000.0 + 0.02, abs=1e-4), "2 mA for 10 ms"


def test_a_bench_that_nobody_looks_into_is_the_plain_device_to_the_bit(make_device) -> None:
    on_bench, plain = (
        BenchDevice(make_device("vo2_a"), is_inspected=False),
        SimulatedDevice(make_device("vo2_a")),
    )
    for one in (on_bench, plain):
        one.set_clock(lockstep=True, period_us=PERIOD_US)
        one.set_enable(True)
    for k in range(50):
        level = (5.0 + 2.0 * math.sin(k / 5.0),)
        assert on_bench.exchange(level, k + 1) == plain.exchange(level, k + 1)


def test_the_names_of_the_devices_faults_are_those_that_a_run_reports() -> None:
    assert {str(one) for one in DeviceFault} == set(OF_DEVICE) <= {str(one) for one in Fault}
    kinds = ServedFault.model_json_schema()["properties"]["kind"]["enum"]
    assert set(kinds) == {*OF_DEVICE, *ServedLine.kinds}


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("fault.stal", 0.1, "fault.stall"),
        ("fault.stall", 0.0, "needs a duration"),
        ("fault.drop", 99.0, "0 to 60 s"),
    ],
)
def test_a_fault_that_is_none_is_refused_in_words(name: str, value: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Bench(device(), ServedLine()).check(name, value)


def request(current_mA: float, sequence: int, transaction: int = 1) -> bytes:
    """Return an exchange, function 23, of Modbus TCP."""
    body = struct.pack(">BHHHHBfH", 23, 100, 10, 0, 3, 6, current_mA, sequence)
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, 1) + body


async def answer(reader: asyncio.StreamReader, within_s: float = 5.0) -> bytes:
    """Return the next answer; empty: the connection is broken."""
    try:
        return await asyncio.wait_for(reader.read(1024), within_s)
    except ConnectionResetError:
        return b""


def on_tcp(bench: Bench, act: Callable[[str, int], Awaitable[None]]) -> None:
    """Serve a bench on TCP and act on it."""

    async def run() -> None:
        async with served(bench.device, Wires(tcp="127.0.0.1:0"), bench) as ends:
            host, _, port = ends.split()[1].rpartition(":")
            await act(host, int(port))

    asyncio.run(run())


@pytest.mark.wire
def test_a_stall_holds_an_answer_back_and_a_drop_loses_it() -> None:
    bench = Bench(BenchDevice(RecordingPlant()), ServedLine())

    rows: list[tuple[float, ...]] = []
    bench.device.account = rows.append

    async def act(host: str, port: int) -> None:
        await asyncio.sleep(0.1)
        assert len(rows) > 1, "time passes also where nobody asks"
        reader, writer = await asyncio.open_connection(host, port)
        loop = asyncio.get_running_loop()
        for kind, duration_s in (("", 0.0), ("stall", 0.2), ("delay", 0.2)):
            if kind:
                bench.apply(f"fault.{kind}", duration_s)
            begun_s = loop.time()
            writer.write(request(2.0, 1))
            assert len(await answer(reader)) == 29
            assert (loop.time() - begun_s >= 0.19) == bool(kind), kind
        bench.apply("fault.drop", 0.0)
        writer.write(request(2.0, 2, 7))
        writer.write(request(2.0, 3, 8))
        await asyncio.sleep(0.1)
        writer.write(request(2.0, 4, 9))
        found = await answer(reader)
        assert found[:2] in (b"\0\x08", b"\0\x09"), "what was lost is not answered later"
        writer.close()

    on_tcp(bench, act)
    assert bench.line.injected == 3


@pytest.mark.wire
def test_a_broken_connection_comes_back_after_its_time_and_a_restart_forgets_all() -> None:
    bench = Bench(BenchDevice(RecordingPlant()), ServedLine())

    async def act(host: str, port: int) -> None:
        reader, writer = await asyncio.open_connection(host, port)
        bench.device.set_enable(True)
        bench.apply("fault.disconnect", 0.2)
        writer.write(request(2.0, 1))
        assert await answer(reader) == b""
        assert bench.device.read().sequence == 0, "the command is lost with the connection"
        writer.close()
        refused, writer = await asyncio.open_connection(host, port)
        assert await answer(refused) == b""
        writer.close()
        await asyncio.sleep(0.25)
        reader, writer = await asyncio.open_connection(host, port)
        writer.write(request(2.0, 1))
        assert len(await answer(reader)) == 29
        assert bench.device.enabled
        bench.apply("fault.device_reboot", 0.0)
        writer.write(request(2.0, 2))
        await answer(reader)
        assert not bench.device.enabled
        writer.close()

    on_tcp(bench, act)


@pytest.mark.wire
def test_a_serial_port_goes_and_comes_again(tmp_path: Path) -> None:
    path = tmp_path / "port"
    line = ServedLine([("disconnect", 1.0, 0.1, None)])
    bench = Bench(BenchDevice(RecordingPlant()), line)

    async def run() -> None:
        async with served(bench.device, Wires(serial_path=path), bench):
            host = os.open(path, os.O_RDWR | os.O_NOCTTY)
            os.write(host, b"\0")
            while os.path.lexists(path):
                await asyncio.sleep(0.01)
            os.close(host)
            while not os.path.lexists(path):
                await asyncio.sleep(0.01)
            assert path.is_char_device()
        assert not os.path.lexists(path)

    asyncio.run(asyncio.wait_for(run(), 10.0))


def test_planned_faults_are_made_and_noted_at_their_time() -> None:
    noted: list[tuple[int, str, str, float]] = []
    bench = Bench(
        device(),
        ServedLine(),
        [PlannedFault(2e-3, "sensor_fault", 1e-3), PlannedFault(4e-3, "drop", 0.0)],
    )
    bench.note = lambda *event: noted.append(event)
    samples(bench.device, 6)
    assert noted == [(30, "fault", "sensor_fault", 1e-3), (50, "fault", "drop", 0.0)]


@pytest.mark.parametrize("form", ["text", "file"])
def test_faults_are_read_from_a_text_or_a_file(form: str, tmp_path: Path) -> None:
    text = "drop rate=0.01 way=to_host; sensor_fault at=5s duration=200ms"
    if form == "file":
        file = tmp_path / "faults.toml"
        file.write_text(
            'seed = 4\n[[faults]]\nkind = "drop"\nrate = 0.01\nway = "to_host"\n'
            '[[faults]]\nkind = "sensor_fault"\nat = "5 s"\nduration = "200 ms"\n'
        )
        text = str(file)
    found = read_faults(text, on_tcp=True)
    first, second = found.faults
    assert (first.kind, first.rate, first.at_s, first.way) == ("drop", 0.01, None, "to_host")
    assert (second.kind, second.rate, second.at_s, second.duration_s) == ("sensor_fault", None, 5.0, 0.2)
    assert found.seed == (4 if form == "file" else 0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("drp rate=1", r"faults\.0\.kind.*known: delay, jitter"),
        ("drop", "needs either rate, .* or at"),
        ("drop rate=0.1 at=1s", "needs either rate, .* or at"),
        ("drop rate=2", r"faults\.0\.rate"),
        ("stall rate=0.1", "stall needs a duration"),
        ("sensor_fault rate=0.1 duration=1s", "a fault of the device: give at"),
        ("bit_flip rate=0.1", "none of a TCP connection"),
        ("stall at=5 duration=1s", 'has no unit; write "5 s"'),
        ("stall at=5 s duration=1s", '"s" is no KEY=VALUE'),
        ("drop at=1s way=to_host", "leave way out"),
        (" ; ", "no fault is in it"),
        ("missing.toml", "missing.toml: no such file"),
    ],
)
def test_a_wrong_text_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_faults(text, on_tcp=True)
