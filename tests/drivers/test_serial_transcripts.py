"""The page of the serial protocol says what goes over the wire: host, simulated device and firmware keep to it."""

from __future__ import annotations

import math
import struct
from binascii import crc_hqx
from pathlib import Path

import pytest
from firmware_cases import board, host_board
from hypothesis import given
from hypothesis import strategies as st
from peers import PtyEnd, scripted
from serial_cases import sessions

from drivers.serial_frames import SerialDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serial_server import SerialDevice
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire.serial_frames import FrameReader, Layout, Message, frame
from rtctl.wiring import load_plant

READINGS = (0x81, 0x82)


def messages(data: bytes) -> list[Message]:
    return FrameReader().feed(data)


@pytest.mark.wire
@pytest.mark.usefixtures("either_form")
def test_the_driver_says_what_the_page_says() -> None:
    session = sessions()[0]
    end = PtyEnd()
    driver = SerialDriver(port=end.path, baud=115200, profile=VO2, first_tag=0x1000)
    with scripted(end, [(exchange.request, exchange.reply) for exchange in session]) as peer:
        first = driver.open(lockstep_period_us=1000, watchdog_ms=250, timeout_s=5.0)
        assert (first.sensed, first.counter, first.time_us, first.status) == ((186767.578125,), 1, 0, 1)
        assert driver.identity == "VO2-A"
        second = driver.exchange((5.0,))
        assert (second.sequence, second.counter, second.time_us) == (0x1004, 2, 1000)
        assert second.sensed[0] == pytest.approx(139930.36, abs=0.01)
        driver.close((6.0,))
        peer.wait()
        assert peer.asked == [exchange.request for exchange in session]


@pytest.mark.wire
def test_the_firmware_answers_what_the_page_says_to_the_byte(host_firmware: Path) -> None:
    with board(host_board(host_firmware)) as device:
        for exchange in [exchange for session in sessions() for exchange in session]:
            assert device.answer(exchange.request) == exchange.reply, exchange.what


def test_the_simulated_device_answers_with_the_same_types_tags_and_errors() -> None:
    """Its physics is another one's, so only what is no reading is compared to the byte."""
    device = SerialDevice(SimulatedDevice(load_plant(bundled_plant("vo2_a"))))
    for exchange in [exchange for session in sessions() for exchange in session]:
        reply = device.receive(exchange.request)
        (found,), (wanted,) = messages(reply), messages(exchange.reply)
        assert (found.type, found.tag, len(found.payload)) == (wanted.type, wanted.tag, len(wanted.payload))
        if found.type in READINGS:
            ours, theirs = Layout(VO2).measurement(found.payload), Layout(VO2).measurement(wanted.payload)
            assert ours is not None
            assert theirs is not None
            keys = ("sequence", "status", "counter", "time_us")
            assert [getattr(ours, key) for key in keys] == [getattr(theirs, key) for key in keys], (
                exchange.what
            )
        elif found.type != 0x84:
            assert reply == exchange.reply, exchange.what


def test_checksum_has_the_published_check_value() -> None:
    assert crc_hqx(b"123456789", 0xFFFF) == 0x29B1


@given(
    kind=st.integers(0, 255), tag=st.integers(0, 0xFFFF), payload=st.binary(max_size=245), noise=st.binary()
)
def test_a_frame_is_found_after_any_noise_and_comes_back_as_it_was(
    kind: int, tag: int, payload: bytes, noise: bytes
) -> None:
    sent = frame(kind, tag, payload)
    assert sent[0] == sent[-1] == 0
    assert 0 not in sent[1:-1]
    assert FrameReader().feed(noise + sent)[-1] == Message(kind, tag, payload)


@given(data=st.data())
def test_a_flipped_bit_is_never_believed(data: st.DataObject) -> None:
    sent = bytearray(frame(1, 0x1234, struct.pack("<f", 5.0)))
    bit = data.draw(st.integers(0, 8 * len(sent) - 1))
    sent[bit // 8] ^= 1 << bit % 8
    assert FrameReader().feed(bytes(sent) + b"\0") in ([], [Message(1, 0x1234, struct.pack("<f", 5.0))])


@given(data=st.binary(max_size=600), cuts=st.lists(st.integers(0, 600), max_size=5))
def test_how_bytes_are_cut_into_reads_does_not_matter(data: bytes, cuts: list[int]) -> None:
    data += frame(2, 7)
    whole, piecewise = FrameReader(), FrameReader()
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    found = [m for a, b in zip(edges, edges[1:], strict=False) for m in piecewise.feed(data[a:b])]
    assert found == whole.feed(data)


def test_a_babbling_line_fills_no_memory() -> None:
    reader = FrameReader()
    for _ in range(100):
        assert reader.feed(b"\x55" * 4096) == []
    assert len(reader._rest) < 300
    assert reader.feed(frame(2, 7)) == [Message(2, 7, b"")]


def test_the_end_of_a_babble_is_no_frame_with_its_beginning() -> None:
    whole = frame(0x81, 7, b"abcd")[1:-1]
    babble = whole[:1] + b"\x01" * 400
    reader = FrameReader()
    assert reader.feed(b"\0" + babble) == []
    assert reader.feed(whole[1:] + b"\0") == []
    assert reader.feed(frame(0x81, 8)) == [Message(0x81, 8, b"")]
    assert FrameReader().feed(b"\0" + babble + whole[1:] + b"\0") == []


def test_reading_keeps_what_is_no_number() -> None:
    layout = Layout(VO2)
    back = layout.measurement(layout.reading(Measurement((math.nan,), math.nan, 2**32 - 1, 5, 65535, 9)))
    assert back is not None
    assert math.isnan(back.sensed[0])
    assert back[2:] == (2**32 - 1, 5, 65535, 9)
