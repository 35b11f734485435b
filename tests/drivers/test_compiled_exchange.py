"""The compiled exchange sends the bytes that Python's sends, and believes, of whatever arrives, what Python's believes.

The far end is a socket pair in this process: what has arrived before the exchange is all that ever will, so that no
test waits.
"""

from __future__ import annotations

import os
import signal
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.compiled.exchange import Kernel, LineExchange, attach
from drivers.compiled.modbus import exchange_rtu, exchange_tcp
from drivers.compiled.serial import exchange_serial
from drivers.modbus_frames import from_rtu, from_tcp, to_rtu, to_tcp, write_then_read_request
from rtctl.border.records import ME, VO2, DeviceProfile
from rtctl.border.wire.compiled_clock import AVAILABLE
from rtctl.border.wire.registers import READING, float32_words, reading_count
from rtctl.border.wire.serial_frames import ERROR, FrameReader, Layout, Message, frame
from rtctl.border.wire.wire_memory import (
    ERRNO,
    REGISTERS,
    REPLY_AT,
    REPLY_LENGTH,
    SENSED_AT,
    SEQUENCE,
    SETTINGS,
    TIMEOUT_NS,
    UNIT,
    Ended,
    WireMemory,
    wire_memory,
)

pytestmark = pytest.mark.skipif(not AVAILABLE, reason="this machine has no compiled exchange")

KERNELS: dict[str, Kernel] = {"tcp": exchange_tcp, "rtu": exchange_rtu, "serial": exchange_serial}
SETTINGS_IN_FORCE = [1, 250, 1, 15, 0x4240]
FLOAT32 = st.floats(width=32) | st.floats(min_value=-3e38, max_value=3e38)
profiles = st.sampled_from([VO2, ME])
wires = st.sampled_from(list(KERNELS))


def memory_of(profile: DeviceProfile, unit: int = 1, timeout_s: float = 0.0) -> WireMemory:
    memory = wire_memory(profile)
    places = [2 * (channel.register - READING) for channel in (*profile.sensed, profile.reference)]
    memory.line[SENSED_AT : SENSED_AT + len(places)] = places
    memory.line[SETTINGS : SETTINGS + 5] = SETTINGS_IN_FORCE
    memory.line[REGISTERS], memory.line[UNIT] = reading_count(profile), unit
    memory.line[TIMEOUT_NS] = round(1e9 * timeout_s)
    return memory


@contextmanager
def far_end(memory: WireMemory, wire: str) -> Iterator[socket.socket]:
    """The other end of a new line."""
    near, far = socket.socketpair()
    with near, far:
        if wire == "tcp":
            memory.line[TIMEOUT_NS] = 10**9  # the socket's own is what ends the wait
            near.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("@ll", 0, 1))
        else:
            near.setblocking(False)
        attach(memory, near.fileno())
        yield far


def asked(wire: str, profile: DeviceProfile, levels: list[float], sequence: int) -> bytes:
    """What Python sends; of TCP the first transaction."""
    if wire == "serial":
        return frame(1, sequence, Layout(profile).command(levels))
    words = [*float32_words(levels[0]), sequence]
    if len(levels) > 1:
        words += SETTINGS_IN_FORCE
    for level in levels[1:]:
        words += float32_words(level)
    pdu = write_then_read_request(0, words, READING, reading_count(profile))
    return to_rtu(1, pdu) if wire == "rtu" else to_tcp(1, 1, pdu)


@settings(deadline=None)  # the first example waits for the compiler
@given(wire=wires, profile=profiles, sequence=st.integers(0, 0xFFFF), data=st.data())
def test_it_sends_the_same_bytes(
    wire: str, profile: DeviceProfile, sequence: int, data: st.DataObject
) -> None:
    levels = data.draw(st.lists(FLOAT32, min_size=len(profile.commands), max_size=len(profile.commands)))
    memory = memory_of(profile)
    memory.line[SEQUENCE] = sequence - 1
    with far_end(memory, wire) as far:
        assert LineExchange(KERNELS[wire], memory).run(levels) == Ended.SILENT
        assert far.recv(4096) == asked(wire, profile, levels, sequence)


def sound_reply(wire: str, profile: DeviceProfile, tag: int, values: list[float]) -> bytes:
    if wire == "serial":
        payload = struct.pack(f"<HHIIf{len(values) - 1}f", tag, 1, 7, 1000, values[-1], *values[:-1])
        return frame(0x81, tag, payload)
    registers = bytearray(2 * reading_count(profile))
    for channel, value in zip((*profile.sensed, profile.reference), values, strict=True):
        struct.pack_into(">f", registers, 2 * (channel.register - READING), value)
    struct.pack_into(">IHI", registers, 4, 7, 1, 1000)
    struct.pack_into(">H", registers, 18, tag)
    pdu = bytes((23, len(registers))) + bytes(registers)
    return to_rtu(1, pdu) if wire == "rtu" else to_tcp(1, 1, pdu)


def with_a_hole(sound: bytes, at: int) -> bytes:
    return sound[:at] + b"\x55" + sound[at + 1 :]


def pieces(wire: str, profile: DeviceProfile) -> st.SearchStrategy[bytes]:
    """What may come on a bad line: noise, damage, other answers, the right one."""
    values = st.lists(
        st.floats(width=32, allow_nan=False),
        min_size=len(profile.sensed) + 1,
        max_size=len(profile.sensed) + 1,
    )
    right = values.map(lambda found: sound_reply(wire, profile, 5, found))
    late = values.map(lambda found: sound_reply(wire, profile, 4, found))
    places = st.integers(0, 99)
    damaged = st.builds(lambda sound, at: with_a_hole(sound, at % len(sound)), right, places)
    cut = st.builds(lambda sound, at: sound[: at % len(sound)], right, places)
    noise = st.binary(max_size=40)
    if wire == "serial":
        other = st.builds(
            frame, st.sampled_from([0x81, 0x82, ERROR]), st.integers(3, 6), st.binary(max_size=30)
        )
        return st.one_of(right, late, damaged, cut, noise, noise.map(lambda b: b + b"\0"), other)
    pdu = st.sampled_from([b"\x97\x03", b"\x83\x02", bytes.fromhex("1000000003"), b"\x17\x02\x01\x02"])
    if wire == "rtu":
        other = st.builds(to_rtu, st.integers(1, 2), pdu)
        return st.one_of(right, late, damaged, cut, noise, other)
    framed = st.builds(to_tcp, st.integers(0, 2), st.integers(1, 2), pdu)
    return st.one_of(right, late, cut, noise, framed)


@settings(deadline=None)  # the first example waits for the compiler
@given(wire=wires, profile=profiles, data=st.data())
def test_it_believes_the_same_of_what_arrives(wire: str, profile: DeviceProfile, data: st.DataObject) -> None:
    arrives = b"".join(data.draw(st.lists(pieces(wire, profile), max_size=5)))
    memory = memory_of(profile)
    memory.line[SEQUENCE] = 4
    with far_end(memory, wire) as far:
        if wire == "rtu":  # it drains what is there before it asks
            ended, found = after_the_request(far, memory, wire, arrives)
        else:
            far.sendall(arrives)
            run = LineExchange(KERNELS[wire], memory)
            ended, found = run.run([1.0] * len(profile.commands)), run
    wanted = believed(wire, profile, arrives)
    if wanted is None:
        assert ended == Ended.SILENT
    elif ended in (Ended.OK, Ended.STALE):
        values = struct.pack(f"{len(profile.sensed)}f", *found.measurement().sensed)
        measured = wanted_reading(wire, profile, wanted)
        assert measured is not None
        assert (values, found.measurement().sequence) == measured
        assert (ended == Ended.OK) == (measured[1] == 5 or bool(found.measurement().status & 16))
    else:
        assert ended == Ended.REPLY
        at, length = memory.line[[REPLY_AT, REPLY_LENGTH]]
        assert memory.inbox[at : at + length].tobytes() == wanted


def after_the_request(
    far: socket.socket, memory: WireMemory, wire: str, arrives: bytes
) -> tuple[int, LineExchange]:
    """`arrives` comes once the request is there; then nothing more."""
    memory.line[TIMEOUT_NS] = 10**10
    run = LineExchange(KERNELS[wire], memory)
    ends: list[int] = []
    thread = threading.Thread(target=lambda: ends.append(run.run([1.0] * len(memory.levels))))
    thread.start()
    far.recv(4096)
    far.sendall(arrives)
    far.shutdown(socket.SHUT_WR)  # read to its end: then it hangs up, which is its silence here
    thread.join(10.0)
    assert not thread.is_alive()
    if ends[0] == Ended.SYSTEM:
        assert memory.line[ERRNO] == 0
        return Ended.SILENT, run
    return ends[0], run


def believed(wire: str, profile: DeviceProfile, arrives: bytes) -> bytes | None:
    """What Python takes for the answer: function code and body, or a serial message's body."""
    if wire == "rtu":
        return from_rtu(1, arrives)
    if wire == "tcp":
        try:
            while (reply := from_tcp(arrives)) is not None:
                if (reply.transaction, reply.unit) == (1, 1):
                    return reply.pdu
                arrives = arrives[reply.used :]
        except ValueError:
            pass
        return None
    for message in FrameReader().feed(arrives):
        if message.tag == 5 and message.type in (0x81, ERROR):
            return struct.pack("<BH", message.type, message.tag) + message.payload
    return None


def wanted_reading(wire: str, profile: DeviceProfile, body: bytes) -> tuple[bytes, int] | None:
    """What is sensed, as float32, and the number in force, if the answer is a reading."""
    if wire == "serial":
        measurement = Layout(profile).measurement(Message(*struct.unpack_from("<BH", body), body[3:]).payload)
        if measurement is None:
            return None
        return struct.pack(f"{len(profile.sensed)}f", *measurement.sensed), measurement.sequence
    registers = body[2:]
    sensed = [struct.unpack_from(">f", registers, 2 * (c.register - READING))[0] for c in profile.sensed]
    return struct.pack(f"{len(sensed)}f", *sensed), struct.unpack_from(">H", registers, 18)[0]


@pytest.mark.parametrize("wire", KERNELS)
def test_an_answer_in_pieces_under_a_hail_of_signals_is_whole(wire: str) -> None:
    """Every wait is cut short by a signal, every read brings a byte."""
    memory = memory_of(VO2, timeout_s=10.0)
    memory.line[SEQUENCE] = 4
    near, far = socket.socketpair()
    before = signal.signal(signal.SIGALRM, lambda *_: None)

    def answer() -> None:
        far.recv(4096)
        for byte in sound_reply(wire, VO2, 5, [1005.0, -5.0]):
            far.sendall(bytes((byte,)))
            time.sleep(1e-3)  # longer than from one signal to the next

    with near, far:
        if wire != "tcp":
            near.setblocking(False)
        attach(memory, near.fileno())
        run = LineExchange(KERNELS[wire], memory)
        thread = threading.Thread(target=answer)
        try:
            signal.setitimer(signal.ITIMER_REAL, 5e-4, 5e-4)
            thread.start()
            assert run.run([5.0]) == Ended.OK
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
            thread.join()
        assert run.measurement() == ((1005.0,), -5.0, 7, 1000, 5, 1)


@pytest.mark.parametrize("wire", KERNELS)
def test_how_a_line_ends_is_told_by_its_errno(wire: str) -> None:
    memory = memory_of(VO2, timeout_s=1.0)
    with far_end(memory, wire) as far:
        far.close()
        ended = LineExchange(KERNELS[wire], memory).run([5.0])
        assert (ended, int(memory.line[ERRNO])) == (Ended.SYSTEM, 32)  # EPIPE
    attach(memory, os.open("/dev/null", os.O_RDONLY))
    ended = LineExchange(KERNELS[wire], memory).run([5.0])
    os.close(int(memory.line[0]))
    assert (ended, int(memory.line[ERRNO])) == (Ended.SYSTEM, 88 if wire == "tcp" else 9)  # ENOTSOCK, EBADF


@pytest.mark.parametrize("wire", KERNELS)
def test_a_level_beyond_float32_is_not_sent(wire: str) -> None:
    memory = memory_of(VO2)
    with far_end(memory, wire) as far:
        far.setblocking(False)
        assert LineExchange(KERNELS[wire], memory).run([1e39]) == Ended.OVERFLOW
        with pytest.raises(BlockingIOError):
            far.recv(4096)
