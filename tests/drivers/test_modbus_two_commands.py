"""A device with a second command in registers 8-9: one transaction over the settings, which are repeated as read."""

from __future__ import annotations

import math

import pytest
import transcripts as t
from peers import TcpEnd, scripted
from transcripts import rtu

from drivers.modbus import ModbusTcpDriver
from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import ME, Measurement

pytestmark = [pytest.mark.wire, pytest.mark.usefixtures("either_form")]

SETTINGS = (  # enable 1, watchdog 250 ms, lockstep, 1 000 000 us
    "0005 0000 0006 01 03 0003 0005",
    "0005 0000 000D 01 03 0A 0001 00FA 0001 000F4240",
)
HANDSHAKE = [
    *t.TCP_HANDSHAKE[:4],
    *rtu(
        SETTINGS,
        ("0006 0000 0006 01 03 0078 0008", "0006 0000 0013 01 03 10 464F524549474E204445564943450000"),
        (
            "0007 0000 0006 01 03 0064 000C",
            "0007 0000 001B 01 03 18 00000000 00000001 0001 00000000 7FC00000 0029 00000000",
        ),
    ),
]
BOTH = "41200000 002A 0001 00FA 0001 000F4240 45EA6000"  # 10 mA, number 42, settings, 7500 Hz
READ = "3F000000 00000002 0001 000F4240 3F400000 002A BF800000"  # 0.5 um, -1 um, reference 0.75 um
AFTER = Measurement((0.5, -1.0), 0.75, 2, 1_000_000, 42, 1)


def opened(end: TcpEnd) -> ModbusTcpDriver:
    driver = ModbusTcpDriver(host="127.0.0.1", port=end.port, unit=1, profile=ME)
    driver.open(lockstep_period_us=1_000_000, watchdog_ms=250, timeout_s=5.0)
    return driver


def test_both_commands_and_all_readings_are_one_transaction() -> None:
    end = TcpEnd()
    exchange = (
        f"0008 0000 001F 01 17 0064 000C 0000 000A 14 {BOTH}",
        f"0008 0000 001B 01 17 18 {READ}",
    )
    script = HANDSHAKE + rtu(exchange)
    with scripted(end, script) as peer:
        driver = opened(end)
        assert driver.exchange((10.0, 7500.0)) == AFTER
        peer.wait()
        assert peer.asked == [request for request, _ in script]
    driver.close((0.0, 7500.0))


def test_without_function_23_it_is_16_then_3() -> None:
    end = TcpEnd()
    script = HANDSHAKE + rtu(
        (f"0008 0000 001F 01 17 0064 000C 0000 000A 14 {BOTH}", "0008 0000 0003 01 97 01"),
        (f"0009 0000 001B 01 10 0000 000A 14 {BOTH}", "0009 0000 0006 01 10 0000 000A"),
        ("000A 0000 0006 01 03 0064 000C", f"000A 0000 001B 01 03 18 {READ}"),
    )
    with scripted(end, script) as peer:
        driver = opened(end)
        assert driver.exchange((10.0, 7500.0)) == AFTER
        peer.wait()
        assert peer.asked == [request for request, _ in script]
    driver.close((0.0, 7500.0))


def test_a_refused_frequency_is_named_with_its_unit() -> None:
    end = TcpEnd()
    nan = BOTH.replace("45EA6000", "7FC00000")
    script = HANDSHAKE + rtu(
        (f"0008 0000 001F 01 17 0064 000C 0000 000A 14 {nan}", "0008 0000 0003 01 97 03")
    )
    with scripted(end, script):
        driver = opened(end)
        with pytest.raises(DriverError, match=r"command 10 mA, nan Hz: .*exception 3") as caught:
            driver.exchange((10.0, math.nan))
        assert caught.value.fault is Fault.COMMAND_REFUSED
    driver.close((0.0, 7500.0))
