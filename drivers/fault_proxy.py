"""A line with faults between host and device, as a process of its own: it may stop the host, and ends with it.

    python -m drivers.fault_proxy PLAN-AS-JSON

prints `ready WHERE` when the host may connect, then a line `TIME_S KIND WAY` for each thing that it does (on the
monotonic clock), until its standard input ends.
"""

from __future__ import annotations

import heapq
import itertools
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass

from drivers.fault_ends import Line, PtyLine, TcpLine
from drivers.fault_line import Delivery, Disturbance, FaultyLine, Injected, Kind, Way
from rtctl.border.errors import InputError

_RECEIVE_BYTES = 4096
_STDIN = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultPlan:
    """A plan of faults between host and device."""

    wire: str
    """ "tcp" or "pty"."""
    target: str
    """HOST:PORT of the device, or the path of its port."""
    disturbances: tuple[Disturbance, ...]
    seed: int = 0
    link: str = ""
    """Path that the host opens, of a pty."""
    host_pid: int = 0
    device_pid: int = 0
    """Process of `rtctl serve`, which restarts its device on SIGUSR1."""
    quiet_s: float = 0.0
    """Pause after each fault [s]: a run has to be under way again to be struck."""

    def __post_init__(self) -> None:
        for kind, pid in ((Kind.HOST_PAUSE, self.host_pid), (Kind.DEVICE_REBOOT, self.device_pid)):
            if not pid and any(disturbance.kind is kind for disturbance in self.disturbances):
                raise InputError(f"{kind} needs the process that it is done to")
        if self.wire == "tcp" and any(d.kind in (Kind.BIT_FLIP, Kind.TRUNCATE) for d in self.disturbances):
            raise InputError(
                "bit_flip and truncate are none of a TCP connection: its checksum turns damage into delay; use delay"
            )

    def to_json(self) -> str:
        """Return the plan as the process takes it."""
        return json.dumps(asdict(self))


def plan_of(text: str) -> FaultPlan:
    """Read a plan that `FaultPlan.to_json` wrote."""
    values = json.loads(text)
    disturbances = tuple(
        Disturbance(
            kind=Kind(d["kind"]),
            rate=d["rate"],
            duration_s=d["duration_s"],
            way=Way(d["way"]) if d["way"] else None,
        )
        for d in values.pop("disturbances")
    )
    return FaultPlan(disturbances=disturbances, **values)


class FaultProxy:
    """A proxy between both ends of a line."""

    def __init__(self, plan: FaultPlan, tell: Callable[[Injected], None] = lambda injected: None) -> None:
        self._tell = tell
        self.line: Line = TcpLine(plan.target) if plan.wire == "tcp" else PtyLine(plan.target, plan.link)
        self._plan = plan
        self._sound, self._faulty = FaultyLine((), 0), FaultyLine(plan.disturbances, plan.seed)
        self._due: list[tuple[float, int, Delivery]] = []
        self._count = itertools.count()  # ties in the heap stay in order
        self._mend_s = self._resume_s = float("inf")
        self._quiet_until_s = 0.0

    @property
    def injected(self) -> list[Injected]:
        """The faults injected so far."""
        return self._faulty.injected

    def run(self, stop: int) -> None:
        """Until the file descriptor `stop` has something to read."""
        while True:
            self._carry_out(time.monotonic())
            line, down = self.line, self._mend_s < float("inf")
            watched = [fd for fd in (stop, -1 if down else line.listener, line.host, line.device) if fd >= 0]
            ready = select.select(watched, [], [], self._wait_s(time.monotonic()))[0]
            if stop in ready:
                self._resume(float("inf"))
                line.close()
                return
            if line.listener in ready:
                line.connect()
                continue
            for way, fd in ((Way.TO_DEVICE, line.host), (Way.TO_HOST, line.device)):
                if fd in ready and fd in (line.host, line.device):
                    self._arrived(way, fd, time.monotonic())

    def _wait_s(self, now_s: float) -> float | None:
        when_s = min(self._mend_s, self._resume_s, self._due[0][0] if self._due else float("inf"))
        return None if when_s == float("inf") else max(0.0, when_s - now_s)

    def _arrived(self, way: Way, fd: int, now_s: float) -> None:
        try:
            data = os.read(fd, _RECEIVE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.line.hang_up()
            if fd == self.line.device:  # a port that has gone for good
                os.close(fd)
                self.line.device = -1
            else:
                self.line.connect()
            return
        before = len(self._faulty.injected)
        line = self._faulty if now_s >= self._quiet_until_s else self._sound
        passed = line.passes(way, data, now_s)
        for injected in self._faulty.injected[before:]:
            self._tell(injected)
            self._quiet_until_s = now_s + self._plan.quiet_s
        for delivery in passed.deliveries:
            heapq.heappush(self._due, (delivery.due_s, next(self._count), delivery))
        for disturbance in passed.struck:
            self._strike(disturbance, now_s)

    def _strike(self, disturbance: Disturbance, now_s: float) -> None:
        if disturbance.kind is Kind.DEVICE_REBOOT:
            os.kill(self._plan.device_pid, signal.SIGUSR1)
        elif disturbance.kind is Kind.HOST_PAUSE:
            os.kill(self._plan.host_pid, signal.SIGSTOP)
            self._resume_s = now_s + disturbance.duration_s
        else:
            self.line.hang_up()
            self._due.clear()
            self._mend_s = now_s + disturbance.duration_s

    def _carry_out(self, now_s: float) -> None:
        """Carry out what is due by now."""
        if now_s >= self._mend_s:
            self._mend_s = float("inf")
            self.line.connect()
        self._resume(now_s)
        while self._due and self._due[0][0] <= now_s:
            delivery = heapq.heappop(self._due)[2]
            fd = self.line.device if delivery.way is Way.TO_DEVICE else self.line.host
            with suppress(OSError):  # it has gone, or nobody reads: a line waits for no one
                os.write(fd, delivery.data)

    def _resume(self, now_s: float) -> None:
        if self._resume_s < float("inf") and now_s >= self._resume_s:
            self._resume_s = float("inf")
            with suppress(ProcessLookupError):
                os.kill(self._plan.host_pid, signal.SIGCONT)


@contextmanager
def faulty_line(plan: FaultPlan) -> Iterator[tuple[str, list[Injected]]]:
    """Run a line in a thread while the block runs; yield where the host connects, and the growing log.

    `host_pause` is not possible here: it would stop this process.
    """
    import threading

    proxy = FaultProxy(plan)
    stopped, stop = os.pipe()
    thread = threading.Thread(target=proxy.run, args=(stopped,))
    thread.start()
    try:
        yield proxy.line.where, proxy.injected
    finally:
        os.write(stop, b"x")
        thread.join()
        os.close(stop)
        os.close(stopped)


def main(arguments: Sequence[str]) -> None:
    """Run the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the host, which still needs its line
    proxy = FaultProxy(plan_of(arguments[0]), lambda injected: print(*injected, flush=True))
    print(f"ready {proxy.line.where}", flush=True)
    proxy.run(_STDIN)


if __name__ == "__main__":
    main(sys.argv[1:])
