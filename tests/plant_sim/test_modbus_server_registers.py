"""The register map, request by request: PDUs written by hand from the map and the Modbus specification."""

from __future__ import annotations

import pytest
from recording_plant import RecordingPlant

from plant_sim.device import SimulatedDevice
from plant_sim.wire.modbus_pdu import answer
from plant_sim.wire.register_file import RegisterFile

ENABLE_LOCKSTEP_1S = "10 0003 0005 0A 0001 0000 0001 000F 4240"  # 3-7: enable, no watchdog, lockstep, 1e6 us
READ_ALL = "03 0064 001C"


class Wire:
    """Hexadecimal PDUs in and out."""

    def __init__(self) -> None:
        self.plant = RecordingPlant()
        self._registers = RegisterFile(SimulatedDevice(self.plant))

    def __call__(self, request: str) -> str:
        return answer(self._registers, bytes.fromhex(request)).hex().upper()


@pytest.fixture
def wire() -> Wire:
    wire = Wire()
    assert wire(ENABLE_LOCKSTEP_1S) == "1000030005"
    return wire


def plain(text: str) -> str:
    return text.replace(" ", "")


def test_function_23_is_one_device_exchange(wire: Wire) -> None:
    reply = wire("17 0064 000A 0000 0003 06 40A00000 0001")
    assert reply == plain("17 14 447B4000 00000001 0001 000F4240 C0A00000 0001")
    assert wire.plant.holds == [(5.0, 1.0)]


def test_function_16_then_3_is_the_same_exchange(wire: Wire) -> None:
    assert wire("10 0000 0003 06 40A00000 0001") == plain("10 0000 0003")
    assert wire("03 0064 000A") == plain("03 14 447B4000 00000001 0001 000F4240 C0A00000 0001")
    assert wire.plant.holds == [(5.0, 1.0)]


def test_current_alone_is_latched_until_a_fresh_sequence_number_arrives(wire: Wire) -> None:
    assert wire("10 0000 0002 04 40A00000") == plain("10 0000 0002")
    assert wire.plant.holds == []
    assert wire("03 0000 0003") == plain("03 06 40A00000 0000")
    assert wire("06 0002 0001") == plain("06 0002 0001")
    assert wire.plant.holds == [(5.0, 1.0)]


def test_words_of_a_current_may_come_one_by_one(wire: Wire) -> None:
    assert wire("06 0000 4048") == plain("06 0000 4048")
    assert wire("06 0001 0000") == plain("06 0001 0000")
    assert wire("06 0002 0009") == plain("06 0002 0009")
    assert wire.plant.holds == [(3.125, 1.0)]


def test_repeated_sequence_number_keeps_the_level_in_force(wire: Wire) -> None:
    wire("10 0000 0003 06 40A00000 0001")
    wire("10 0000 0003 06 40C00000 0001")
    assert wire.plant.holds == [(5.0, 1.0)]


def test_settings_read_back(wire: Wire) -> None:
    wire("06 0004 00FA")
    assert wire("03 0000 0008") == plain("03 10 00000000 0000 0001 00FA 0001 000F4240")


def test_whole_map_written_at_once_sets_then_enables_then_commands() -> None:
    wire = Wire()
    assert wire("10 0000 0008 10 40A00000 0001 0001 0000 0001 000F4240") == plain("10 0000 0008")
    assert wire.plant.holds == [(5.0, 1.0)]


def test_registers_without_content_read_zero_and_identity_is_ascii(wire: Wire) -> None:
    reply = wire(READ_ALL)
    assert reply[: 2 * 2] == "0338"
    assert reply[2 * 22 : 2 * 42] == "00" * 20
    assert bytes.fromhex(reply[2 * 42 :]) == b"RECORDER" + bytes(8)


@pytest.mark.parametrize(
    "request_pdu",
    [
        "03 0008 0001",
        "03 0063 0001",
        "03 0007 0002",
        "03 0000 0065",
        "03 007F 0002",
        "03 0080 0001",
        "03 FFFF 0001",
        "03 FFFF 0002",
        "06 0008 0000",
        "06 0064 0000",
        "06 0078 0000",
        "10 0007 0002 04 0000 0000",
        "10 0064 0002 04 3F80 0000",
        "17 0064 000A 0064 0001 02 0000",
    ],
)
def test_outside_the_map_is_exception_2(wire: Wire, request_pdu: str) -> None:
    before = wire("03 0000 0008") + wire(READ_ALL)
    assert wire(request_pdu) == f"{int(request_pdu[:2], 16) | 0x80:02X}02"
    assert wire("03 0000 0008") + wire(READ_ALL) == before


def test_function_23_with_a_bad_read_range_does_not_move_the_device(wire: Wire) -> None:
    assert wire("17 0080 0001 0000 0003 06 40A00000 0001") == "9702"
    assert wire.plant.holds == []
    assert wire("03 0000 0003") == "03060000" + "00000000"


@pytest.mark.parametrize("current", ["7FC00000", "7F800000", "FF800000"])
@pytest.mark.parametrize("request_pdu", ["17 0064 000A 0000 0003 06 {} 0001", "10 0000 0003 06 {} 0001"])
def test_current_that_is_no_number_is_exception_3_and_changes_nothing(
    wire: Wire, request_pdu: str, current: str
) -> None:
    before = wire("03 0000 0008") + wire(READ_ALL)
    assert wire(request_pdu.format(current)) == f"{int(request_pdu[:2], 16) | 0x80:02X}03"
    assert wire("03 0000 0008") + wire(READ_ALL) == before
    assert wire.plant.holds == []


def test_refused_write_applies_none_of_its_registers(wire: Wire) -> None:
    assert wire("10 0000 0004 08 40A00000 0001 0002") == "9003"  # enable 2
    assert wire.plant.holds == []
    assert wire("03 0000 0003") == "0306" + "0" * 12


@pytest.mark.parametrize(
    "request_pdu",
    [
        "06 0003 0002",  # enable
        "06 0005 0002",  # clock
        "10 0006 0002 04 0000 0000",  # period
        "03 0064 0000",  # counts
        "03 0064 007E",
        "03 0064",
        "06 0003",
        "10 0000 0003 04 40A00000 0001",
        "10 0000 0000 00",
        "10 0000",
        "17 0064 000A 0000 0003 06 40A00000",
        "17 0064 0000 0000 0003 06 40A00000 0001",
        "17 0064 000A",
    ],
)
def test_illegal_value_or_count_is_exception_3(wire: Wire, request_pdu: str) -> None:
    assert wire(request_pdu) == f"{int(request_pdu[:2], 16) | 0x80:02X}03"
    assert wire.plant.holds == []


@pytest.mark.parametrize("function", [1, 2, 4, 5, 7, 15, 22, 43, 65])
def test_other_functions_are_exception_1(wire: Wire, function: int) -> None:
    assert wire(f"{function:02X} 0064 0001") == f"{function | 0x80:02X}01"


def test_disabled_device_answers_and_says_that_it_refused() -> None:
    reply = Wire()("17 0064 000A 0000 0003 06 40A00000 0001")
    assert reply[2 * 10 : 2 * 12] == "0010"
    assert reply[-4:] == "0000"
