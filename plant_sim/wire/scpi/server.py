"""An instrument on a TCP port or at the end of a pty: lines in, lines out, one after the other."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from typing import Protocol

from plant_sim.wire.faulty_wire import FaultyWire
from plant_sim.wire.pty_server import BITS_A_BYTE
from plant_sim.wire.tcp_port import listening

LONGEST_LINE = 1 << 16


class Answering(Protocol):
    """An instrument behind its line."""

    async def answer(self, message: str) -> str:
        """Carry out a line; return its answer, "" if it has none."""
        ...


class _Conversation:
    """One line to a host, with its faults and, with a baud rate [bit/s], the time that bytes need on it."""

    def __init__(
        self,
        answer: Callable[[str], Awaitable[str]],
        send: Callable[[bytes], None],
        faults: FaultyWire | None,
        baud: int | None = None,
    ) -> None:
        self._answer, self._send, self._faults, self._baud = answer, send, faults, baud
        self._lines = asyncio.StreamReader(LONGEST_LINE)
        self._has_ended = False
        self._task = asyncio.create_task(self._converse())

    def arrive(self, data: bytes) -> None:
        """Take what the host has sent."""
        if self._faults is None:
            self._lines.feed_data(data)
        else:
            self._faults.to_device(data, self._lines.feed_data)

    def finish(self) -> None:
        """Carry out the lines that have arrived whole; nobody hears of it."""
        self._has_ended = True
        self._lines.feed_eof()

    def end(self) -> None:
        """Forget what is on its way."""
        self._has_ended = True
        self._task.cancel()

    async def _converse(self) -> None:
        while True:
            try:
                line = await self._lines.readuntil(b"\n")
            except (asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                return
            await self._pass(line)
            said = await self._answer(line.decode("ascii", "replace").strip("\r\n "))
            if not said:
                continue
            reply = f"{said}\n".encode("ascii", "replace")
            await self._pass(reply)
            if self._faults is None:
                self._leave(reply)
            else:
                self._faults.to_host(reply, self._leave)

    async def _pass(self, data: bytes) -> None:
        if self._baud is not None:
            await asyncio.sleep(len(data) * BITS_A_BYTE / self._baud)

    def _leave(self, data: bytes) -> None:
        if not self._has_ended:
            self._send(data)


class _TcpLine(asyncio.Protocol):
    """A client of the TCP server."""

    def __init__(
        self,
        answer: Callable[[str], Awaitable[str]],
        lines: dict[asyncio.Transport, _Conversation],
        faults: FaultyWire | None,
    ) -> None:
        self._answer, self._lines, self._faults = answer, lines, faults

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._lines[transport] = _Conversation(self._answer, transport.write, self._faults)

    def data_received(self, data: bytes) -> None:
        self._lines[self._transport].arrive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._lines.pop(self._transport).finish()  # an instrument does what it was told before the host went


@asynccontextmanager
async def serve_lines_tcp(
    instrument: Answering, host: str, port: int, faults: FaultyWire | None = None
) -> AsyncIterator[int]:
    """Answer on `host:port` while the block runs; yields the port (0 asks for a free one). Raises OSError."""
    turn = asyncio.Lock()
    lines: dict[asyncio.Transport, _Conversation] = {}

    async def answer(line: str) -> str:
        async with turn:  # a second client waits until a reading is taken
            return await instrument.answer(line)

    def connected() -> asyncio.Protocol:
        return _TcpLine(answer, lines, faults)

    async with listening(host, port, connected, lambda: lines, faults) as bound:
        yield bound


@contextmanager
def serve_lines_pty(
    instrument: Answering, master: int, baud: int | None, faults: FaultyWire | None = None
) -> Iterator[None]:
    """Answer on the pty whose master is the file descriptor `master`, while the block runs in an event loop."""

    def send(data: bytes) -> None:
        with suppress(OSError):  # nobody reads, or the line is broken: a line waits for no one
            os.write(master, data)

    line = _Conversation(instrument.answer, send, faults, baud)

    def receive() -> None:
        with suppress(BlockingIOError):  # nothing there after all
            line.arrive(os.read(master, 4096))

    loop = asyncio.get_running_loop()
    os.set_blocking(master, False)
    loop.add_reader(master, receive)
    try:
        yield
    finally:
        loop.remove_reader(master)
        line.end()
