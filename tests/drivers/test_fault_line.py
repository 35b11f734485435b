"""A line with faults does what its plan says, no more: the kernel by its log, the proxy over a pty and TCP."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from peers import serving

from drivers.fault_line import Disturbance, FaultyLine, Kind, Way
from drivers.fault_proxy import FaultPlan, faulty_line, plan_of
from drivers.modbus import ModbusRtuDriver, ModbusTcpDriver
from drivers.serial_frames import SerialDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.journal import JournalledDevice, read_journal
from plant_sim.wire.register_file import RegisterFile
from plant_sim.wire.serve import Wires
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import VO2, DeviceStatus, Driver
from rtctl.wiring import load_plant

BURST = bytes(range(40))
EXCHANGES = 50
THERE, BACK = Way.TO_DEVICE, Way.TO_HOST


def line(kind: Kind, duration_s: float = 0.0, rate: float = 1.0, way: Way | None = None) -> FaultyLine:
    return FaultyLine([Disturbance(kind=kind, rate=rate, duration_s=duration_s, way=way)], seed=3)


def out(faulty: FaultyLine, now_s: float = 10.0, way: Way = THERE) -> list[tuple[float, bytes]]:
    return [(round(due_s, 9), data) for due_s, _, data in faulty.passes(way, BURST, now_s).deliveries]


def test_a_sound_line_passes_everything_at_once() -> None:
    assert out(FaultyLine([], 0)) == [(10.0, BURST)]


def test_each_kind_does_its_own_thing() -> None:
    assert out(line(Kind.DELAY, 0.5)) == [(10.5, BURST)]
    assert out(line(Kind.DROP)) == []
    assert out(line(Kind.DUPLICATE)) == [(10.0, BURST)] * 2
    assert out(line(Kind.REORDER, 0.5)) == [(10.5, BURST)]
    ((due_s, _),) = out(line(Kind.JITTER, 0.5))
    assert 10.0 <= due_s <= 10.5
    ((_, flipped),) = out(line(Kind.BIT_FLIP))
    assert sum((a ^ b).bit_count() for a, b in zip(flipped, BURST, strict=True)) == 1
    assert all(
        BURST.startswith(data) and len(data) < 40 for _ in range(20) for _, data in out(line(Kind.TRUNCATE))
    )


def test_what_follows_a_delay_waits_and_overtakes_a_reordered_burst() -> None:
    for kind, due_s in ((Kind.DELAY, 10.5), (Kind.REORDER, 10.1)):
        faulty = line(kind, 0.5)
        faulty.passes(THERE, BURST, 10.0)
        faulty._disturbances = ()
        assert out(faulty, 10.1) == [(due_s, BURST)]
        assert out(faulty, 10.2, BACK) == [(10.2, BURST)], "the other direction is another wire"


def test_a_stall_holds_both_directions() -> None:
    faulty = line(Kind.STALL, 0.5)
    assert out(faulty) == [(10.5, BURST)]
    faulty._disturbances = ()
    assert out(faulty, 10.3, BACK) == [(10.5, BURST)]
    assert out(faulty, 10.6, BACK) == [(10.6, BURST)]


def test_the_rate_is_the_share_of_bursts_and_a_seed_repeats_it() -> None:
    faulty, again = line(Kind.DROP, rate=0.2, way=BACK), line(Kind.DROP, rate=0.2, way=BACK)
    for burst in range(5000):
        for way in Way:
            faulty.passes(way, BURST, float(burst))
            again.passes(way, BURST, float(burst))
    assert faulty.injected == again.injected
    assert {injected.way for injected in faulty.injected} == {BACK}
    assert len(faulty.injected) == pytest.approx(1000, abs=5 * (5000 * 0.2 * 0.8) ** 0.5)


def test_what_the_line_itself_cannot_do_is_handed_over() -> None:
    for kind in (Kind.DISCONNECT, Kind.DEVICE_REBOOT, Kind.HOST_PAUSE):
        passed = line(kind).passes(THERE, BURST, 0.0)
        assert [disturbance.kind for disturbance in passed.struck] == [kind]


def test_a_plan_that_cannot_be_is_bad_input() -> None:
    flip = Disturbance(kind=Kind.BIT_FLIP, rate=0.1)
    with pytest.raises(InputError, match="rate is a share"):
        Disturbance(kind=Kind.DROP, rate=1.5)
    with pytest.raises(InputError, match="none of a TCP connection"):
        FaultPlan(wire="tcp", target="127.0.0.1:1", disturbances=(flip,))
    with pytest.raises(InputError, match="host_pause needs the process"):
        FaultPlan(wire="pty", target="x", disturbances=(Disturbance(kind=Kind.HOST_PAUSE, rate=0.1),))
    plan = FaultPlan(wire="pty", target="x", link="y", disturbances=(flip,), seed=4, quiet_s=0.5)
    assert plan_of(plan.to_json()) == plan


def driver_of(wire: str, where: str) -> Driver:
    if wire == "tcp":
        host, _, port = where.rpartition(":")
        return ModbusTcpDriver(host=host, port=int(port), unit=1, profile=VO2)
    if wire == "rtu":
        return ModbusRtuDriver(port=where, baud=115200, unit=1, profile=VO2)
    return SerialDriver(port=where, baud=115200, profile=VO2)


def struck_by(
    wire: str, disturbance: Disturbance, folder: Path, timeout_s: float = 0.3
) -> tuple[Counter[str], JournalledDevice, int]:
    """EXCHANGES sound ones over a faulty line, opening again after each fault: the faults, the device, how many."""
    device = JournalledDevice(load_plant(bundled_plant("vo2_a"), seed=5))
    port = folder / "device"
    wires = {"tcp": Wires(tcp="127.0.0.1:0"), "rtu": Wires(rtu_path=port), "serial": Wires(serial_path=port)}[
        wire
    ]
    faults: Counter[str] = Counter()
    with serving(device, wires) as ends:
        plan = FaultPlan(
            wire="tcp" if wire == "tcp" else "pty",
            target=ends.split()[1],
            disturbances=(disturbance,),
            link=str(folder / "line"),
            seed=1,
        )
        with faulty_line(plan) as (where, injected):
            driver = driver_of(wire, where)
            is_open, sound, end_s = False, 0, time.monotonic() + 60.0
            while sound < EXCHANGES and time.monotonic() < end_s:
                try:
                    if not is_open:
                        driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=timeout_s)
                        is_open = True
                    reading = driver.exchange((4.0 + 0.01 * sound,))
                    assert reading.sensed in {entry.values for entry in device.journal()[-40:]}
                    sound += 1
                except DriverError as error:
                    faults[str(error.fault)] += 1
                    driver.close((0.0,))
                    is_open = False
            driver.close((0.0,))
    return faults, device, len(injected)


@pytest.mark.wire
@pytest.mark.parametrize(
    ("wire", "kind", "duration_s"),
    [
        pytest.param("serial", Kind.DROP, 0.0, marks=pytest.mark.slow),
        ("serial", Kind.BIT_FLIP, 0.0),
        ("serial", Kind.TRUNCATE, 0.0),
        pytest.param("rtu", Kind.BIT_FLIP, 0.0, marks=pytest.mark.slow),
        pytest.param("rtu", Kind.DELAY, 0.35, marks=pytest.mark.slow),
        pytest.param("tcp", Kind.DROP, 0.0, marks=pytest.mark.slow),
        ("tcp", Kind.DISCONNECT, 0.02),
        pytest.param("serial", Kind.DISCONNECT, 0.02, marks=pytest.mark.slow),
    ],
)
def test_faults_of_a_wire_are_named_nothing_wrong_is_believed_and_nothing_unsafe_is_done(
    wire: str, kind: Kind, duration_s: float, tmp_path: Path
) -> None:
    disturbance = Disturbance(kind=kind, rate=0.04, duration_s=duration_s)
    faults, device, injected = struck_by(wire, disturbance, tmp_path)
    assert injected > 0
    assert set(faults) <= {str(fault) for fault in Fault}
    assert faults, "what is not answered has a name"
    sent = [entry.values[0] for entry in device.journal() if entry.event == "command"]
    assert all(0.0 <= level <= 4.6 for level in sent), sent
    assert len(sent) >= EXCHANGES, "after each fault it went on"


@pytest.mark.wire
@pytest.mark.parametrize("kind", [Kind.DUPLICATE, Kind.DELAY, Kind.REORDER])
def test_what_a_serial_line_can_bear_is_borne(kind: Kind, tmp_path: Path) -> None:
    faults, device, injected = struck_by(
        "serial", Disturbance(kind=kind, rate=0.2, duration_s=0.01), tmp_path, 10.0
    )
    assert injected > 5
    assert not faults
    counters = [entry.number for entry in device.journal() if entry.event == "command"]
    assert len(counters) == len(set(counters)), "a command that arrives twice counts once"


def test_a_device_that_restarts_forgets_its_settings_and_stays_off() -> None:
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5), lambda: 0.0)
    registers = RegisterFile(device)
    device.set_watchdog(100)
    device.set_clock(lockstep=True, period_us=1000)
    device.set_enable(True)
    assert device.exchange((6.0,), 9).status == DeviceStatus.ENABLED
    registers.power_cycle()
    assert (device.enabled, device.watchdog_ms, device.lockstep) == (False, 0, False)
    reading = device.read()
    assert (reading.counter, reading.sequence, reading.status) == (1, 0, 0)
    device.command((6.0,), 10)
    assert device.read().status == DeviceStatus.REFUSED
    assert registers.read(0, 3) == bytes(6)


@pytest.mark.wire
def test_a_host_that_is_paused_finds_the_device_safe_by_its_own_account(tmp_path: Path) -> None:
    """The host is a process of its own, stopped for longer than the device's lease."""
    port, journal = tmp_path / "port", tmp_path / "journal.csv"
    serve = [
        sys.executable,
        "-m",
        "rtctl",
        "serve",
        "vo2_a",
        "--serial",
        str(port),
        "--journal",
        str(journal),
    ]
    host = f"""
from drivers.serial_frames import SerialDriver
from rtctl.border.records import VO2
driver = SerialDriver(port={str(port)!r}, baud=115200, profile=VO2)
driver.open(lockstep_period_us=None, watchdog_ms=200, timeout_s=5.0)
driver.exchange((6.0,))
print("hot", flush=True)
input()
print(driver.exchange((6.0,)).status, flush=True)
"""
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as device:
        assert device.stdout is not None
        device.stdout.readline()
        with subprocess.Popen(
            [sys.executable, "-c", host], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as controller:
            assert controller.stdout is not None
            assert controller.stdout.readline() == "hot\n"
            os.kill(controller.pid, signal.SIGSTOP)
            time.sleep(0.5)  # the device's own clock has to pass its lease
            os.kill(controller.pid, signal.SIGCONT)
            assert int(controller.communicate("\n", timeout=30.0)[0]) & DeviceStatus.WATCHDOG_TRIPPED
        device.send_signal(signal.SIGTERM)
        device.wait(30.0)
    held_us = [
        entry.number for entry in read_journal(journal) if entry.event == "applied" and entry.values == (6.0,)
    ]
    assert held_us == [200_000]
