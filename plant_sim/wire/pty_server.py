"""A device that answers bytes with bytes, on the master of a pty; on request with the wire's own time.

A pty carries any number of bytes at once. With a baud rate every byte takes its ten bits: a request is acted upon when
its last byte would have arrived, and its answer is there when the last byte of that would be.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

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


@asynccontextmanager
async def serve_pty(answer: Answer, master: int, baud: int | None) -> AsyncIterator[None]:
    """Answer on the pty whose master is the file descriptor `master`, while the block runs."""
    loop = asyncio.get_running_loop()
    there = _WireTime(baud, loop.time) if baud else None
    back = _WireTime(baud, loop.time) if baud else None
    pending: set[asyncio.TimerHandle] = set()

    def send(reply: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads: a line waits for no one
            os.write(master, reply)

    def act(request: bytes) -> None:
        if reply := answer(request):
            if back is None:
                send(reply)
            else:
                later(back.passed_at(len(reply)), send, reply)

    def later(when_s: float, what: Callable[[bytes], None], data: bytes) -> None:
        def run() -> None:
            pending.discard(timer)
            what(data)

        timer = loop.call_at(when_s, run)
        pending.add(timer)

    def receive() -> None:
        with suppress(BlockingIOError):  # nothing there after all
            request = os.read(master, 4096)
            if there is None:
                act(request)
            else:
                later(there.passed_at(len(request)), act, request)

    os.set_blocking(master, False)
    loop.add_reader(master, receive)
    try:
        yield
    finally:
        loop.remove_reader(master)
        for timer in pending:
            timer.cancel()
