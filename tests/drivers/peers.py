"""Devices at the other end of a wire: one that follows a script, and a simulated one that is served."""

from __future__ import annotations

import asyncio
import os
import select
import socket
import threading
import tty
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Protocol

from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires, served

Script = list[tuple[bytes, bytes]]
"""(expected request, what is sent back); an empty reply is silence."""


class End(Protocol):
    """The device's end of a wire."""

    def fileno(self) -> int: ...

    def receive(self) -> bytes: ...

    def send(self, data: bytes) -> None: ...


class PtyEnd:
    """A pty's master; the driver opens `path`, whose number is nobody else's while this object lives."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._open = True
        weakref.finalize(
            self, os.close, self._slave
        )  # a driver that reconnects meets no other test's terminal

    def fileno(self) -> int:
        return self._master

    def receive(self) -> bytes:
        return os.read(self._master, 4096)

    def send(self, data: bytes) -> None:
        os.write(self._master, data)

    def send_and_wait(self, data: bytes) -> None:
        """Return when `data` waits at the driver's end."""
        self.send(data)
        assert select.select([self._slave], [], [], 5.0)[0]

    def vanish(self) -> None:
        if self._open:
            self._open = False
            os.close(self._master)


class TcpEnd:
    """A listening socket that takes one client after the other; the driver connects to `port`."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self.clients = 0
        self._client: socket.socket | None = None

    def fileno(self) -> int:
        return (self._client or self._listener).fileno()

    def receive(self) -> bytes:
        """A new client, or an old one's end, gives no bytes."""
        if self._client is None:
            self._client, _ = self._listener.accept()
            self.clients += 1
            return b""
        data = self._client.recv(4096)
        if not data:
            self._client.close()
            self._client = None
        return data

    def send(self, data: bytes) -> None:
        assert self._client is not None
        self._client.sendall(data)

    def vanish(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
        self._listener.close()


class ScriptedPeer:
    """Answers by its script in a thread of its own; `asked` is what it was really asked."""

    def __init__(self, end: End, script: Script) -> None:
        self.asked: list[bytes] = []
        self._end = end
        self._script = script
        self._stopped, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._follow)
        self._thread.start()

    def _follow(self) -> None:
        arrived = b""
        for expected, reply in self._script:
            while len(arrived) < len(expected):
                ready, _, _ = select.select([self._end, self._stopped], [], [])
                if self._stopped in ready:
                    return
                arrived += self._end.receive()
            self.asked.append(arrived[: len(expected)])
            arrived = arrived[len(expected) :]  # pipelined: the next request may be here already
            if reply:
                self._end.send(reply)

    def wait(self) -> None:
        """Until the script is at its end."""
        self._thread.join(10.0)
        assert not self._thread.is_alive(), f"asked so far: {[data.hex() for data in self.asked]}"

    def stop(self) -> None:
        os.write(self._stop, b"x")
        self._thread.join()
        os.close(self._stop)
        os.close(self._stopped)


@contextmanager
def scripted(end: PtyEnd | TcpEnd, script: Script) -> Iterator[ScriptedPeer]:
    """A peer that follows `script`; the end is closed with the block."""
    peer = ScriptedPeer(end, script)
    try:
        yield peer
    finally:
        peer.stop()
        end.vanish()


@contextmanager
def serving(device: SimulatedDevice, wires: Wires) -> Iterator[str]:
    """`device` served from a thread; yields the words of the ready line."""
    ready: SimpleQueue[tuple[str, asyncio.AbstractEventLoop, asyncio.Event]] = SimpleQueue()

    async def serve() -> None:
        stop = asyncio.Event()
        async with served(device, wires) as ends:
            ready.put((ends, asyncio.get_running_loop(), stop))
            await stop.wait()

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    ends, loop, stop = ready.get(timeout=20.0)
    try:
        yield ends
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(20.0)
        assert not thread.is_alive()
