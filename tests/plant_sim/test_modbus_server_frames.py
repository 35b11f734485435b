"""Frames on the line: transcripts with checksums and headers written by hand, and what a bad line does."""

from __future__ import annotations

import asyncio

import pytest
from recording_plant import ManualClock, RecordingPlant

from plant_sim.device import SimulatedDevice
from plant_sim.wire.modbus_server import RtuDevice, TcpConnection, serve_tcp
from plant_sim.wire.register_file import RegisterFile


def frame(text: str) -> bytes:
    return bytes.fromhex(text)


FUNCTION_23 = frame("01 17 0064 000A 0000 0003 06 40A00000 0001 7AAE")
FUNCTION_23_REPLY = frame("01 17 14 447B4000 00000001 0001 000F4240 C0A00000 0001 3291")


def registers() -> RegisterFile:
    """Enabled, lockstep, one second."""
    device = SimulatedDevice(RecordingPlant())
    device.set_clock(lockstep=True, period_us=1_000_000)
    device.set_enable(True)
    return RegisterFile(device)


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def line(clock: ManualClock) -> RtuDevice:
    return RtuDevice(registers(), clock)


@pytest.mark.parametrize(
    ("transcript"),
    [
        [(FUNCTION_23, FUNCTION_23_REPLY)],
        [
            (frame("01 10 0000 0003 06 40A00000 0001 A999"), frame("01 10 0000 0003 8008")),
            (
                frame("01 03 0064 000A 8412"),
                frame("01 03 14 447B4000 00000001 0001 000F4240 C0A00000 0001 666F"),
            ),
        ],
        [(frame("01 06 0003 0001 B80A"), frame("01 06 0003 0001 B80A"))],
        [(frame("01 17 0064 000A 0000 0003 06 7FC00000 0001 FFA9"), frame("01 97 03 0E31"))],
        [(frame("01 03 0008 0001 05C8"), frame("01 83 02 C0F1"))],
        [(frame("01 07 41E2"), frame("01 87 01 8230"))],
    ],
    ids=["23", "16 then 3", "6", "NaN", "outside the map", "unknown function"],
)
def test_transcript(line: RtuDevice, transcript: list[tuple[bytes, bytes]]) -> None:
    for request, reply in transcript:
        assert line.receive(request) == reply


@pytest.mark.parametrize(
    "request_frame", ["02 03 0064 000A 8421", "00 06 0003 0001 B9DB"], ids=["unit 2", "broadcast"]
)
def test_only_unit_1_answers(line: RtuDevice, request_frame: str) -> None:
    assert line.receive(frame(request_frame)) == b""
    assert line.receive(FUNCTION_23) == FUNCTION_23_REPLY


def test_request_may_arrive_byte_by_byte(line: RtuDevice) -> None:
    replies = [line.receive(bytes((byte,))) for byte in FUNCTION_23]
    assert replies == [b""] * (len(FUNCTION_23) - 1) + [FUNCTION_23_REPLY]


def test_damaged_request_is_not_answered_and_does_not_spoil_the_next(line: RtuDevice) -> None:
    damaged = bytearray(FUNCTION_23)
    damaged[8] ^= 1
    assert line.receive(bytes(damaged)) == b""
    assert line.receive(FUNCTION_23) == FUNCTION_23_REPLY


def test_half_request_does_not_spoil_the_next_after_a_silence(line: RtuDevice, clock: ManualClock) -> None:
    assert line.receive(FUNCTION_23[:7]) == b""
    clock.now_s += 0.05
    assert line.receive(FUNCTION_23) == FUNCTION_23_REPLY


async def _talk(sent: list[bytes], expected: int) -> bytes:
    """What a TCP server answers to `sent`, up to `expected` bytes or the end of the connection."""
    async with serve_tcp(registers(), "127.0.0.1", 0) as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for part in sent:
            writer.write(part)
            await writer.drain()
        try:
            return await asyncio.wait_for(reader.readexactly(expected), 5.0)
        except asyncio.IncompleteReadError as end:
            return end.partial
        finally:
            writer.close()
            await writer.wait_closed()


TCP_23 = frame("0007 0000 0011 01 17 0064 000A 0000 0003 06 40A00000 0001")
TCP_23_REPLY = frame("0007 0000 0017 01 17 14 447B4000 00000001 0001 000F4240 C0A00000 0001")
TCP_READ = frame("0008 0000 0006 01 03 0000 0003")
TCP_READ_REPLY = frame("0008 0000 0009 01 03 06 40A00000 0001")


@pytest.mark.wire
@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        ([TCP_23], TCP_23_REPLY),
        ([TCP_23 + TCP_READ], TCP_23_REPLY + TCP_READ_REPLY),
        ([frame("0001 0000 0006 02 03 0064 000A") + TCP_23], TCP_23_REPLY),
        ([frame("0009 0000 0006 01 03 0080 0001")], frame("0009 0000 0003 01 83 02")),
        ([frame("0009 0000 0002 01 41")], frame("0009 0000 0003 01 C1 01")),
    ],
    ids=["23", "pipelined", "another unit", "outside the map", "unknown function"],
)
def test_tcp_transcript(sent: list[bytes], answered: bytes) -> None:
    assert asyncio.run(_talk(sent, len(answered))) == answered


@pytest.mark.wire
@pytest.mark.parametrize("header", ["0001 0001 0006 01 03", "0001 0000 0001 01 03", "0001 0000 00FF 01 03"])
def test_tcp_connection_ends_on_a_header_that_is_not_modbus(header: str) -> None:
    assert asyncio.run(_talk([frame(header)], 1)) == b""


class Outbox(asyncio.Transport):
    """Keeps what is written."""

    def __init__(self) -> None:
        super().__init__()
        self.sent = b""

    def write(self, data: object) -> None:
        assert isinstance(data, bytes)
        self.sent += data


@pytest.mark.parametrize("size", [1, 3, 7, 24])
def test_tcp_requests_may_arrive_in_pieces(size: int) -> None:
    outbox, connection = Outbox(), TcpConnection(registers(), set())
    connection.connection_made(outbox)
    stream = TCP_23 + TCP_READ
    for start in range(0, len(stream), size):
        connection.data_received(stream[start : start + size])
    assert outbox.sent == TCP_23_REPLY + TCP_READ_REPLY
