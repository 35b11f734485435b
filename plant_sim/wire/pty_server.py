"""A device that answers bytes with bytes, on the master of a pty; on request with the wire's own time.

A pty carries any number of bytes at once. With a baud rate every byte takes its ten bits: a request is acted upon when
its last byte would have arrived, and its answer is there when the last byte of that would be.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path

from plant_sim.wire.faulty_wire import FaultyWire
from plant_sim.wire.virtual_port import virtual_port
from rtctl.border.errors import InputError

Answer = Callable[[bytes], bytes]
"""Maps bytes that arrived to the answer; empty: nothing (yet)."""

BITS_A_BYTE = 10


class _WireTime:
    """The time at which bytes have passed a line of `baud` bit/s that carries one after the other."""

    def __init__(self, baud: int, now: Callable[[], float]) -> None:
        self._byte_s = BITS_A_BYTE / baud
        self._now = now
        self._free_s = 0.0

    def passed_at(self, count: int) -> float:
        """Return when bytes have passed [s], on the clock of `now`."""
        self._free_s = max(self._free_s, self._now()) + count * self._byte_s
        return self._free_s


@contextmanager
def serve_pty(
    answer: Answer, master: int, baud: int | None, faults: FaultyWire | None = None
) -> Iterator[None]:
    """Answer on the pty whose master is the file descriptor `master`, while the block runs in an event loop."""
    pty = _Pty(answer, master, baud, faults)
    os.set_blocking(master, False)
    loop = asyncio.get_running_loop()
    loop.add_reader(master, pty.receive)
    try:
        yield
    finally:
        loop.remove_reader(master)
        pty.cancel()


class _Pty:
    """The way of a request to the device and of its answer back: the line with its faults, then the wire's time."""

    def __init__(self, answer: Answer, master: int, baud: int | None, faults: FaultyWire | None) -> None:
        self._loop = asyncio.get_running_loop()
        self._answer, self._master, self._faults = answer, master, faults
        self._there = _WireTime(baud, self._loop.time) if baud else None
        self._back = _WireTime(baud, self._loop.time) if baud else None
        self._pending: set[asyncio.TimerHandle] = set()

    def receive(self) -> None:
        """Take what has arrived."""
        with suppress(BlockingIOError):  # nothing there after all
            request = os.read(self._master, 4096)
            if self._faults is None:
                self._arrive(request)
            else:
                self._faults.to_device(request, self._arrive)

    def cancel(self) -> None:
        """Forget what is on its way."""
        self._master = -1  # its number may be another file's by the time that a late answer comes
        for timer in self._pending:
            timer.cancel()

    def _arrive(self, request: bytes) -> None:
        self._at(self._there, self._act, request)

    def _act(self, request: bytes) -> None:
        reply = self._answer(request)
        if reply and self._faults is not None:
            self._faults.to_host(reply, self._leave)
        elif reply:
            self._leave(reply)

    def _leave(self, reply: bytes) -> None:
        self._at(self._back, self._send, reply)

    def _send(self, reply: bytes) -> None:
        with suppress(OSError):  # nobody reads, or the line is broken: a line waits for no one
            os.write(self._master, reply)

    def _at(self, wire: _WireTime | None, what: Callable[[bytes], None], data: bytes) -> None:
        """Do it when the bytes have passed the wire; at once without one."""
        if wire is None:
            what(data)
            return

        def run() -> None:
            self._pending.discard(timer)
            what(data)

        timer = self._loop.call_at(wire.passed_at(len(data)), run)
        self._pending.add(timer)


class PortEnd:
    """A serial port that appears under a path, and with faults also goes and comes again."""

    def __init__(
        self, path: Path, serve: Callable[[int], AbstractContextManager[None]], faults: FaultyWire | None
    ) -> None:
        """Open the port inside an event loop; `serve` answers on its master. Raises InputError."""
        self._path, self._serve = path, serve
        self._open = ExitStack()
        self._again: asyncio.TimerHandle | None = None
        self.open()
        if faults is not None:
            faults.hang_up.append(self._hang_up)

    def open(self) -> None:
        """Let the port appear. Raises InputError where the path is in use."""
        self._open.enter_context(self._serve(self._open.enter_context(virtual_port(self._path))))

    def close(self) -> None:
        """Let the port go."""
        if self._again is not None:
            self._again.cancel()
        self._open.close()

    def _hang_up(self, duration_s: float) -> None:
        """Let the port go, as an adapter that is unplugged, and come again."""
        self.close()
        self._again = asyncio.get_running_loop().call_later(duration_s, self._open_again)

    def _open_again(self) -> None:
        try:
            self.open()
        except InputError as error:  # somebody has taken the path meanwhile
            print(f"the port does not come back: {error}", file=sys.stderr)
