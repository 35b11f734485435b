"""A simulated device on a wire: Modbus RTU on a pty's master, Modbus TCP on a socket, one loop for all.

The transport is ours because pymodbus's serial server opens a port by its path, which a pty's master has
not, and because it answers a request two scheduler rounds after it arrived. Frames of a serial line are
checked by pymodbus's RTU framer; a TCP header is four numbers and needs no framer. What a request means is
`modbus_pdu`. One loop serves every client, so that each request is one step of the device. Only unit 1
answers.
"""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU

from plant_sim.wire.faulty_wire import FaultyWire
from plant_sim.wire.modbus_pdu import answer
from plant_sim.wire.register_file import RegisterFile
from plant_sim.wire.tcp_port import listening

UNIT = 1
SILENCE_S = 0.02
"""A half request older than this is forgotten. 3.5 characters would be 1.75 ms, but a pty's data passes
through a kernel worker that is up to 9 ms late on a loaded machine."""

_MBAP = struct.Struct(">HHHB")
_MAX_TCP_PDU = 253


class RtuDevice:
    """The RTU side of a device: bytes in, bytes out, without a port."""

    def __init__(self, registers: RegisterFile, clock: Callable[[], float] = time.monotonic) -> None:
        self._registers = registers
        self._clock = clock
        self._framer = FramerRTU(DecodePDU(True))
        self._buffer = b""
        self._last_s = clock()

    def receive(self, data: bytes) -> bytes:
        """Return the reply to the request that `data` completes; empty: incomplete, damaged, another unit's."""
        now_s = self._clock()
        if self._buffer and now_s - self._last_s > SILENCE_S:
            self._buffer = b""
        self._last_s = now_s
        self._buffer += data
        used, unit, _, request = self._framer.decode(self._buffer)
        self._buffer = self._buffer[used:]
        if not request or unit != UNIT:
            return b""
        return self._framer.encode(answer(self._registers, request), UNIT, 0)


class TcpConnection(asyncio.Protocol):
    """A client of the TCP server; requests may be pipelined."""

    def __init__(
        self, registers: RegisterFile, connections: set[TcpConnection], faults: FaultyWire | None = None
    ) -> None:
        self._registers = registers
        self._connections = connections
        self._faults = faults
        self._buffer = b""
        self.transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See `asyncio.Protocol`."""
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        self._connections.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """See `asyncio.Protocol`."""
        self._connections.discard(self)

    def data_received(self, data: bytes) -> None:
        """Answer every whole request; a header that is not Modbus ends the connection."""
        if self._faults is None:
            self._send(self._answers(data))
        else:
            self._faults.to_device(data, self._answer_late)

    def _answer_late(self, data: bytes) -> None:
        assert self._faults is not None
        self._faults.to_host(self._answers(data), self._send)

    def _send(self, replies: bytes) -> None:
        assert self.transport is not None
        if replies:
            self.transport.write(replies)

    def _answers(self, data: bytes) -> bytes:
        """Return the replies to the requests that `data` completes."""
        assert self.transport is not None
        buffer, replies = self._buffer + data, []
        while len(buffer) >= _MBAP.size:
            transaction, protocol, length, unit = _MBAP.unpack_from(buffer)
            if protocol != 0 or not 2 <= length <= _MAX_TCP_PDU + 1:
                self.transport.close()
                break
            end = length + 6
            if len(buffer) < end:
                break
            if unit == UNIT:
                reply = answer(self._registers, buffer[_MBAP.size : end])
                replies.append(_MBAP.pack(transaction, 0, len(reply) + 1, unit) + reply)
            buffer = buffer[end:]
        self._buffer = buffer
        return b"".join(replies)


@asynccontextmanager
async def serve_tcp(
    registers: RegisterFile, host: str, port: int, faults: FaultyWire | None = None
) -> AsyncIterator[int]:
    """Answer on `host:port` while the block runs; yields the port (0 asks for a free one). Raises OSError."""
    connections: set[TcpConnection] = set()

    def transports() -> list[asyncio.Transport]:
        return [one.transport for one in connections if one.transport is not None]

    def connected() -> asyncio.Protocol:
        return TcpConnection(registers, connections, faults)

    async with listening(host, port, connected, transports, faults) as bound:
        yield bound
