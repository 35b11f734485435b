"""A wire with faults on purpose between host and device, at the device's end: bytes come later, otherwise or never."""

from __future__ import annotations

import asyncio
import heapq
import itertools
from collections.abc import Callable

from plant_sim.bench.line import Line, Passed

REBOOT = "device_reboot"
"""The fault that power-cycles the device; each other one that the line leaves to the server breaks its connections."""


class FaultyWire:
    """The line of one server; hosts that are connected at once share it."""

    def __init__(self, line: Line, reboot: Callable[[], None]) -> None:
        """Put `line` before a device; `reboot` power-cycles it."""
        self.line = line
        self.hang_up: list[Callable[[float], None]] = []
        """What breaks the connections of a transport for so long [s]; each transport adds its own."""
        self._reboot = reboot
        self._due: list[tuple[float, int, Callable[[bytes], None], bytes]] = []
        self._count = itertools.count()  # what is due at one time stays in order

    def to_device(self, data: bytes, deliver: Callable[[bytes], None]) -> None:
        """Pass a request, which `deliver` hands to the device."""
        self._pass(self.line.to_device(data, asyncio.get_running_loop().time()), deliver)

    def to_host(self, data: bytes, deliver: Callable[[bytes], None]) -> None:
        """Pass an answer, which `deliver` hands to the host."""
        if data:
            self._pass(self.line.to_host(data, asyncio.get_running_loop().time()), deliver)

    def _pass(self, passed: Passed, deliver: Callable[[bytes], None]) -> None:
        loop = asyncio.get_running_loop()
        for kind, duration_s in passed[1]:
            if kind == REBOOT:
                self._reboot()
            else:
                self._due.clear()
                for hang_up in self.hang_up:
                    hang_up(duration_s)
                return  # what was on the line is lost with it
        for due_s, data in passed[0]:
            if due_s <= loop.time():
                deliver(data)
            else:
                heapq.heappush(self._due, (due_s, next(self._count), deliver, data))
                loop.call_at(due_s, self._carry_out)

    def _carry_out(self) -> None:
        """Deliver what is due by now."""
        now_s = asyncio.get_running_loop().time()
        while self._due and self._due[0][0] <= now_s:
            _, _, deliver, data = heapq.heappop(self._due)
            deliver(data)
