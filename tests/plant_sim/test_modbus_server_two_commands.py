"""A device with two commands and two readings, request by request: the second command in 8-9, reading in 110-111."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import pytest

from plant_sim.device import SimulatedDevice
from plant_sim.wire.modbus_pdu import answer
from plant_sim.wire.register_file import RegisterFile
from rtctl.border.records import ME

ENABLE_LOCKSTEP_1S = "10 0003 0005 0A 0001 0000 0001 000F 4240"
EXCHANGE = "17 0064 000C 0000 000A 14 {} {} 0001 0000 0001 000F 4240 {}"  # 0-9 written, 100-111 read


def word(value: float) -> str:
    return struct.pack(">f", value).hex().upper()


class Echo:
    """Reads back what it is told: current, minus frequency, and the reference 2 um."""

    profile = ME
    identity = "ECHO"
    low = (0.0, 6000.0)
    high = (100.0, 9000.0)
    safe = (0.0, 7500.0)

    def __init__(self) -> None:
        self.holds: list[tuple[float, ...]] = []

    def reset(self) -> None:
        self.holds = []

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        self.holds.append(tuple(levels))

    def measure(self) -> tuple[tuple[float, ...], float]:
        current, frequency = self.holds[-1] if self.holds else (0.0, 0.0)
        return (current, -frequency), 2.0

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        self.advance(levels, dt_s)
        return self.measure()


class Wire:
    """Hexadecimal PDUs in and out."""

    def __init__(self) -> None:
        self.plant = Echo()
        self._registers = RegisterFile(SimulatedDevice(self.plant))

    def __call__(self, request: str) -> str:
        return answer(self._registers, bytes.fromhex(request)).hex().upper()


@pytest.fixture
def wire() -> Wire:
    wire = Wire()
    assert wire(ENABLE_LOCKSTEP_1S) == "1000030005"
    return wire


def test_one_write_over_the_settings_commands_both_channels_and_reads_both_back(wire: Wire) -> None:
    reply = wire(EXCHANGE.format("41200000", "0001", "45EA6000"))  # 10 mA, 7500 Hz
    assert reply == "1718" + "41200000" + "00000001" + "0001" + "000F4240" + "40000000" + "0001" + "C5EA6000"
    assert wire.plant.holds == [(10.0, 7500.0)]


def test_function_16_then_3_is_the_same_exchange(wire: Wire) -> None:
    wire("10 0000 000A 14 41200000 0001 0001 0000 0001 000F 4240 45EA6000")
    assert wire("03 006E 0002") == "0304C5EA6000"
    assert wire.plant.holds == [(10.0, 7500.0)]


def test_a_frequency_alone_is_latched_and_takes_effect_with_the_next_sequence_number(wire: Wire) -> None:
    assert wire("10 0008 0002 04 45DAC000") == "1000080002"  # 7000 Hz
    assert wire.plant.holds == []
    wire("10 0000 0003 06 41200000 0001")
    assert wire.plant.holds == [(10.0, 7000.0)]
    assert wire("03 0008 0002") == "030445DAC000"


def test_before_any_command_the_frequency_is_the_safe_one_and_the_current_0(wire: Wire) -> None:
    assert wire(
        "03 0000 000A"
    ) == "0314" + "00000000" + "0000" + "0001" + "0000" + "0001" + "000F4240" + word(7500.0)
    assert wire("10 0000 0003 06 41200000 0001") == "1000000003"
    assert wire.plant.holds == [(10.0, 7500.0)]


@pytest.mark.parametrize("frequency", ["7FC00000", "7F800000", "FF800000"])
def test_a_frequency_that_is_no_number_is_exception_3_and_changes_nothing(wire: Wire, frequency: str) -> None:
    before = wire("03 0000 000A")
    assert wire(EXCHANGE.format("41200000", "0001", frequency)) == "9703"
    assert wire(f"10 0008 0002 04 {frequency}") == "9003"
    assert wire("03 0000 000A") == before
    assert wire.plant.holds == []


def test_a_frequency_beyond_the_devices_limits_is_clamped_and_said(wire: Wire) -> None:
    reply = wire(EXCHANGE.format("41200000", "0001", word(12000.0)))
    assert wire.plant.holds == [(10.0, 9000.0)]
    assert reply[4 + 2 * 8 : 4 + 2 * 10] == "0005", "enabled and clamped"


@pytest.mark.parametrize("request_pdu", ["03 000A 0001", "03 0009 0002", "10 0009 0002 04 0000 0000"])
def test_the_map_ends_behind_the_last_command(wire: Wire, request_pdu: str) -> None:
    assert wire(request_pdu) == f"{int(request_pdu[:2], 16) | 0x80:02X}02"


def test_settings_repeated_with_a_command_do_not_re_arm_a_tripped_watchdog() -> None:
    now = [0.0]
    device = SimulatedDevice(Echo(), clock=lambda: now[0])
    registers = RegisterFile(device)
    frame = "0000 000A 14 41200000 {} 0001 0064 0000 000F 4240 45EA6000"  # watchdog 100 ms, free-running
    answer(registers, bytes.fromhex("10" + "0003 0005 0A 0001 0064 0000 000F 4240"))
    answer(registers, bytes.fromhex("10" + frame.format("0001")))
    now[0] = 1.0
    reply = answer(registers, bytes.fromhex("17 0064 000C" + frame.format("0002"))).hex()
    assert reply[4 + 2 * 8 : 4 + 2 * 10] == "0013", "enabled, tripped, refused"
