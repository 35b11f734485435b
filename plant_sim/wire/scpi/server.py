"""An instrument on a TCP port or at the end of a pty: lines in, lines out, one after the other."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from typing import Protocol

from plant_sim.wire.pty_server import BITS_A_BYTE

LONGEST_LINE = 1 << 16


class Answering(Protocol):
    """An instrument behind its line."""

    async def answer(self, message: str) -> str:
        """Carry out a line; return its answer, "" if it has none."""
        ...


async def _converse(
    lines: asyncio.StreamReader, send: Callable[[bytes], None], answer: Callable[[str], Awaitable[str]]
) -> None:
    while True:
        try:
            line = await lines.readuntil(b"\n")
        except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, ConnectionError):
            return
        said = await answer(line.decode("ascii", "replace").strip("\r\n "))
        if said:
            send(f"{said}\n".encode("ascii"))


@asynccontextmanager
async def serve_lines_tcp(instrument: Answering, host: str, port: int) -> AsyncIterator[int]:
    """Answer on `host:port` while the block runs; yields the port (0 asks for a free one). Raises OSError."""
    turn = asyncio.Lock()
    clients: dict[asyncio.StreamWriter, asyncio.Task[None] | None] = {}

    async def answer(line: str) -> str:
        async with turn:  # a second client waits until a reading is taken
            return await instrument.answer(line)

    async def client(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        clients[writer] = asyncio.current_task()
        try:
            await _converse(reader, writer.write, answer)
        finally:
            del clients[writer]
            writer.close()

    server = await asyncio.start_server(client, host, port, limit=LONGEST_LINE)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        tasks = [task for task in clients.values() if task is not None]
        for writer in clients:
            writer.transport.abort()
        await asyncio.gather(*tasks, return_exceptions=True)
        await server.wait_closed()


@asynccontextmanager
async def serve_lines_pty(instrument: Answering, master: int, baud: int | None) -> AsyncIterator[None]:
    """Answer on the pty whose master is the file descriptor `master`, while the block runs.

    With a baud rate [bit/s] lines and answers take the time that they need on such a line; None: they take none.
    """
    loop = asyncio.get_running_loop()
    lines = asyncio.StreamReader(LONGEST_LINE)

    def receive() -> None:
        with suppress(BlockingIOError):  # nothing there after all
            lines.feed_data(os.read(master, 4096))

    def send(data: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads: a line waits for no one
            os.write(master, data)

    async def answer(line: str) -> str:
        if baud is None:
            return await instrument.answer(line)
        await asyncio.sleep((len(line) + 1) * BITS_A_BYTE / baud)
        said = await instrument.answer(line)
        await asyncio.sleep((len(said) + 1) * BITS_A_BYTE / baud if said else 0.0)
        return said

    os.set_blocking(master, False)
    loop.add_reader(master, receive)
    task = asyncio.create_task(_converse(lines, send, answer))
    try:
        yield
    finally:
        loop.remove_reader(master)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
