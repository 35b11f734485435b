"""The driver with each shipped table at its simulated instrument: same resistance, safe currents, off at the end."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from scpi_cases import (
    HIGH_A,
    LOW_A,
    TABLES,
    SlowDevice,
    commanded,
    driver_at,
    instrument_at,
    spoilt_instrument,
    whole,
)

from drivers.scpi.ports import serial_place
from plant_sim.wire.scpi.models import keithley_2400, keithley_2450
from rtctl.border.errors import DriverError, Fault, InputError

pytestmark = pytest.mark.wire

OPEN = {"lockstep_period_us": None, "watchdog_ms": 10_000, "timeout_s": 5.0}
SILENT = ("nothing", "half a line")


@pytest.mark.parametrize("wire", ["tcp", "pty"])
@pytest.mark.parametrize("table", TABLES)
def test_each_shipped_table_drives_its_instrument(table: str, wire: str, tmp_path: Path) -> None:
    device = SlowDevice()
    where = "127.0.0.1:0" if wire == "tcp" else str(tmp_path / "port")
    with instrument_at(device, table, where) as found:
        driver = driver_at(found if wire == "tcp" else serial_place(found, 57600), table)
        first = driver.open(**OPEN)
        assert device.enabled
        readings = [driver.exchange((level,)) for level in (4.0, 6.0, 8.49)]
        measured = [entry.values[0] for entry in device.journal() if entry.event == "reading"]
        driver.close((3.68,))
        assert not device.enabled
    told = [reading.sensed[0] for reading in (first, *readings)]
    assert told == pytest.approx(measured[1::2], rel=3e-6), "the others are when a level is set"
    assert [reading.counter for reading in readings] == [2, 3, 4]
    assert driver.identity.endswith("VO2-SLOW")
    assert commanded(device) == pytest.approx([3.68, 4.0, 6.0, 8.49, 3.68], rel=1e-6)


def test_a_current_outside_of_the_limits_is_not_sent() -> None:
    device = SlowDevice()
    with instrument_at(device, "keithley-2450") as where:
        driver = driver_at(where)
        driver.open(**OPEN)
        for level in (8.5, 3.6, -5.0, float("nan")):
            with pytest.raises(DriverError, match=r"was not sent: it is outside of \[limits\]") as caught:
                driver.exchange((level,))
            assert caught.value.fault is Fault.LEVEL_LIMIT
        driver.close((3.68,))
    assert all(1e3 * LOW_A * 0.999999 <= level <= 1e3 * HIGH_A * 1.000001 for level in commanded(device))


BAD = {
    "another identity": ("*IDN?", b"ACME,MODEL 1,7,2\n", Fault.COMMAND_REFUSED,
                         r"its identity is 'ACME,MODEL 1,7,2', the table"),
    "an error": (":SYST:ERR?", b'-222,"Parameter data out of range"\n', Fault.COMMAND_REFUSED,
                 r"'\*RST' was refused: -222 Parameter data out of range"),
    "nothing": (":READ?", b"", Fault.NO_ANSWER, r"no answer to ':READ\?' within 200 ms: nothing came"),
    "half a line": (":READ?", b"+1.0E+00,+3.68", Fault.NO_ANSWER,
                    r"only '\+1.0E\+00,\+3.68' arrived, without an end of line"),
    "a field too few": (":READ?", b"+1.0E+00\n", Fault.NO_ANSWER, r"3 values were expected \(voltage, curr"),
    "no number": (":READ?", b"oops,1,0\n", Fault.NO_ANSWER, r"'oops' is no number for voltage"),
    "overflow": (":READ?", b"+9.9E+37,+3.68E-03,0\n", Fault.OUT_OF_RANGE, r"a voltage beyond its range \(9.9e\+37"),
    "no reading": (":READ?", b"+9.91E+37,+3.68E-03,0\n", Fault.NOT_FINITE, r"has no voltage to tell"),
    "compliance": (":READ?", b"+2.0E+01,+3.68E-03,8\n", Fault.COMPLIANCE, r"in compliance: 20 V do not drive 3.68 mA"),
    "another current": (":READ?", b"+2.0E+00,+5.0E-03,0\n", Fault.COMMAND_REFUSED, r"3.68 mA was commanded, 5 mA flow"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_answer_is_one_message_and_the_output_is_off(case: str) -> None:
    question, said, fault, words = BAD[case]
    device = SlowDevice()

    def respond(line: str, sound: str) -> bytes:
        return said if line.startswith(question) else whole(sound)

    with spoilt_instrument(keithley_2400(device), respond) as where:
        driver = driver_at(where, "keithley-2400")
        with pytest.raises(DriverError, match=words) as caught:
            driver.open(**OPEN | {"timeout_s": 0.2 if case in SILENT else 5.0})
        assert not device.enabled
    assert caught.value.fault is fault
    assert str(caught.value).startswith(f"scpi {where} (Keithley 2400): ")
    assert "\n" not in str(caught.value)


def test_errors_of_an_earlier_program_are_not_held_against_this_one() -> None:
    instrument = keithley_2400(SlowDevice())
    asyncio.run(instrument.answer(":WHAT 1"))
    with spoilt_instrument(instrument, lambda line, sound: whole(sound)) as where:
        driver = driver_at(where, "keithley-2400")
        driver.open(**OPEN)
        driver.close((3.68,))


def test_the_compliance_voltage_is_that_of_the_instrument() -> None:
    device = SlowDevice()
    with instrument_at(device, "keithley-2450") as where:
        driver = driver_at(where, compliance_V=2.0)
        with pytest.raises(DriverError, match=r"2 V do not drive 3\.68 mA through the device"):
            driver.open(**OPEN)
        assert not device.enabled
    flowed = [
        entry.values[0] for entry in device.journal() if entry.event == "applied" and entry.values[0] > 0.0
    ]
    assert 0.5 < max(flowed) < 1.5, "2 V over the 1.87 kohm of a cold film"


def test_a_late_answer_of_before_is_not_taken_for_a_reading(tmp_path: Path) -> None:
    """After a timeout the port is opened again, and the old answer comes only then."""
    device = SlowDevice()
    held: list[bytes] = []

    def respond(line: str, sound: str) -> bytes:
        if line.startswith(":READ?") and len(held) == 0:
            held.append(whole(sound))
            return b""
        late = held[0] if len(held) == 1 and line == "*IDN?" else b""
        held.extend([b""] if late else [])
        return late + whole(sound)

    with spoilt_instrument(keithley_2450(device), respond) as where:
        driver = driver_at(where)
        with pytest.raises(DriverError, match="no answer"):
            driver.open(**OPEN | {"timeout_s": 0.1})
        assert driver.open(**OPEN).sensed[0] > 1000.0
        driver.close((3.68,))
    assert len(held) == 2, "the late answer was sent"


def test_lockstep_is_refused() -> None:
    with pytest.raises(InputError, match=r"--set clock.mode=live"):
        driver_at("127.0.0.1:1").open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=0.1)


HOST = """
import sys, time
sys.path[:0] = sys.argv[2:]
from scpi_cases import driver_at
driver = driver_at(sys.argv[1])
driver.open(lockstep_period_us=None, watchdog_ms=2000, timeout_s=5.0)
driver.exchange((5.0,))
print("on", flush=True)
while True:
    driver.exchange((5.0,))
    time.sleep(0.02)
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_host_that_is_gone_leaves_the_output_off(end: signal.Signals) -> None:
    device = SlowDevice()
    with instrument_at(device, "keithley-2450") as where:
        command = [sys.executable, "-c", HOST, where, str(Path(__file__).parent), *sys.path]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as host:
            try:
                assert host.stdout is not None
                assert host.stdout.readline() == "on\n"
                assert device.enabled
                os.kill(host.pid, end)
                assert device.went_off.wait(10.0)
            finally:
                host.kill()


def test_a_host_that_stalled_hears_that_the_output_was_switched_off() -> None:
    device = SlowDevice()
    with instrument_at(device, "keithley-2450") as where:
        driver = driver_at(where)
        driver.open(**OPEN | {"watchdog_ms": 50})
        assert not device.went_off.wait(0.2), "the watchdog sleeps until the first command"
        driver.exchange((5.0,))
        assert device.went_off.wait(10.0)
        with pytest.raises(DriverError, match=r"no command for longer than clock\.watchdog") as caught:
            driver.exchange((5.0,))
        driver.close((3.68,))
    assert caught.value.fault is Fault.WATCHDOG_TRIPPED


def test_an_instrument_that_does_not_confirm_is_told(caplog: pytest.LogCaptureFixture) -> None:
    device = SlowDevice()

    def respond(line: str, sound: str) -> bytes:
        return b"" if line == ":OUTP?" else whole(sound)

    with spoilt_instrument(keithley_2450(device), respond) as where:
        driver = driver_at(where, setup_timeout_s=0.5)
        driver.open(**OPEN)
        driver.close((3.68,))
    assert [record.message for record in caplog.records] == [
        f"scpi {where} (Keithley 2450): does not confirm that its output is off; switch it off by hand"
    ]
