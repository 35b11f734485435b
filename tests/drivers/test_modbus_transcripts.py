"""The drivers say on the wire what the register map asks for, byte by byte."""

from __future__ import annotations

import math

import pytest
import transcripts as t
from peers import PtyEnd, Script, TcpEnd, scripted
from transcripts import rtu

from drivers.modbus import ModbusRtuDriver, ModbusTcpDriver
from rtctl.border.records import VO2, Measurement

pytestmark = [pytest.mark.wire, pytest.mark.usefixtures("either_form")]

AFTER_42 = Measurement((1005.0,), -5.0, 2, 1_000_000, 42, 1)
AFTER_43 = Measurement((1011.0,), -11.0, 3, 2_000_000, 43, 1)


def rtu_driver(end: PtyEnd) -> ModbusRtuDriver:
    return ModbusRtuDriver(port=end.path, baud=115200, unit=1, profile=VO2)


def open_lockstep(driver: ModbusRtuDriver | ModbusTcpDriver) -> Measurement:
    return driver.open(lockstep_period_us=1_000_000, watchdog_ms=250, timeout_s=5.0)


def requests(script: Script) -> list[bytes]:
    return [request for request, _ in script]


def test_rtu_session() -> None:
    end, script = (
        PtyEnd(),
        t.HANDSHAKE + rtu((t.COMMAND_42, t.REPLY_42), (t.SAFE_43, t.REPLY_43), t.ENABLE_OFF),
    )
    driver = rtu_driver(end)
    with scripted(end, script) as peer:
        first = open_lockstep(driver)
        assert (first.sensed, first.counter, first.status, first.sequence) == ((1000.0,), 1, 1, 41)
        assert math.isnan(first.reference)
        assert driver.identity == "FOREIGN DEVICE"
        assert driver.exchange((5.0,)) == AFTER_42
        driver.close((0.0,))
        peer.wait()
        assert peer.asked == requests(script)


def test_tcp_session() -> None:
    end = TcpEnd()
    script = t.TCP_HANDSHAKE + rtu((t.TCP_COMMAND_42, t.TCP_REPLY_42), (t.TCP_COMMAND_43, t.TCP_REPLY_43))
    driver = ModbusTcpDriver(host="127.0.0.1", port=end.port, unit=1, profile=VO2)
    with scripted(end, script) as peer:
        open_lockstep(driver)
        assert driver.identity == "FOREIGN DEVICE"
        assert driver.exchange((5.0,)) == AFTER_42
        assert driver.exchange((6.0,)) == AFTER_43
        peer.wait()
        assert peer.asked == requests(script)
    driver.close((0.0,))


def test_free_running_sets_the_clock_register_alone() -> None:
    script = rtu(t.ENABLE_OFF, t.FREE_RUNNING, t.WATCHDOG_250MS, t.ENABLE_ON, t.IDENTITY, t.FIRST_READING)
    end = PtyEnd()
    driver = rtu_driver(end)
    with scripted(end, script) as peer:
        driver.open(lockstep_period_us=None, watchdog_ms=250, timeout_s=5.0)
        peer.wait()
        assert peer.asked == requests(script)
    driver.close((0.0,))


def test_device_without_function_23_is_driven_with_16_then_3_from_then_on() -> None:
    end = PtyEnd()
    script = t.HANDSHAKE + rtu((t.COMMAND_42, t.NO_FUNCTION_23), t.WRITE_42, t.READ_42, t.WRITE_43, t.READ_43)
    driver = rtu_driver(end)
    with scripted(end, script) as peer:
        open_lockstep(driver)
        assert driver.exchange((5.0,)) == AFTER_42
        assert driver.exchange((6.0,)) == AFTER_43
        peer.wait()
        assert peer.asked == requests(script)
    driver.close((0.0,))


def test_device_without_identity_has_an_empty_one() -> None:
    end = PtyEnd()
    script = rtu(t.ENABLE_OFF, t.LOCKSTEP_1S, t.WATCHDOG_250MS, t.ENABLE_ON, t.NO_IDENTITY, t.FIRST_READING)
    driver = rtu_driver(end)
    with scripted(end, script):
        assert open_lockstep(driver).sequence == 41
        assert driver.identity == ""
    driver.close((0.0,))


def test_sequence_number_goes_on_from_the_device_and_wraps() -> None:
    end = PtyEnd()
    script = rtu(
        *(t.ENABLE_OFF, t.LOCKSTEP_1S, t.WATCHDOG_250MS, t.ENABLE_ON, t.IDENTITY),
        t.FIRST_READING_65535,
        (t.COMMAND_0, t.REPLY_0),
    )
    driver = rtu_driver(end)
    with scripted(end, script) as peer:
        assert open_lockstep(driver).sequence == 65535
        assert driver.exchange((5.0,)).sequence == 0
        peer.wait()
        assert peer.asked == requests(script)
    driver.close((0.0,))
