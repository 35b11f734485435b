"""Cases on worker processes that may crash, hang or eat memory: what becomes of a case is a result of it.

Each case runs under a limit of processor time and of memory that the kernel holds. What is known of it is sent as it
comes, so that a worker that dies takes only what was under way with it.
"""

from __future__ import annotations

import os
import resource
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any

Line = dict[str, Any]
Told = Callable[[str, Line], None]
"""(stage that begins, what is known by now)"""
Run = Callable[[Line, Told], Line]
"""(task, told) -> the finished line; a function of a module, as it is started anew in each worker."""
GIB = 2**30


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Of each stage of a case."""

    cpu_s: float = 400.0
    memory_GiB: float = 6.0
    wall_factor: float = 8.0
    """Times `cpu_s` by the clock: for a case that waits for ever."""


@dataclass
class _Worker:
    process: Any
    connection: Connection
    task: Line
    stage: str = "start"
    begun: float = field(default_factory=time.monotonic)
    known: Line = field(default_factory=dict)


def results(
    tasks: Sequence[Line], run: Run, count: int, limits: Limits, check: Callable[[], None] = lambda: None
) -> Iterator[Line]:
    """Lines as they finish. Where a worker died: what was known, with `died` (crash | timeout), `stage`, `error`.

    `check` is called before a worker starts, and may raise.
    """
    waiting, at_work = deque(tasks), list[_Worker]()
    try:
        while waiting or at_work:
            while waiting and len(at_work) < count:
                check()
                at_work.append(_started(waiting.popleft(), run, limits))
            ready = wait([w.connection for w in at_work], timeout=2.0)
            for worker in list(at_work):
                finished = None
                if worker.connection in ready:
                    finished = _heard(worker)
                elif time.monotonic() - worker.begun > limits.wall_factor * limits.cpu_s:
                    worker.process.kill()
                    worker.process.join()
                    finished = _line(worker, "timeout", f"{worker.stage}: over its time by the clock")
                if finished is None:
                    continue
                yield finished
                if waiting and worker.process.is_alive():
                    worker.task, worker.known = waiting.popleft(), {}
                    worker.stage, worker.begun = "start", time.monotonic()
                    worker.connection.send(worker.task)
                else:
                    at_work.remove(worker)
                    _ended(worker)
    finally:
        for worker in at_work:
            worker.process.kill()
            worker.process.join()


def _started(task: Line, run: Run, limits: Limits) -> _Worker:
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"  # one core a worker
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, run, limits), daemon=True)
    process.start()
    theirs.close()
    ours.send(task)
    return _Worker(process, ours, task)


def _heard(worker: _Worker) -> Line | None:
    """A finished line, or None where it only told how far it is."""
    try:
        kind, stage, line = worker.connection.recv()
    except (EOFError, ConnectionResetError):
        worker.process.join()
        code = worker.process.exitcode or 0
        if code == -signal.SIGXCPU:
            return _line(worker, "timeout", f"{worker.stage}: over its processor time")
        return _line(worker, "crash", f"{worker.stage}: the process ended with code {code}")
    worker.known = line
    if kind == "done":
        return dict(line)
    worker.stage, worker.begun = stage, time.monotonic()
    return None


def _line(worker: _Worker, died: str, error: str) -> Line:
    return worker.task | worker.known | {"died": died, "stage": worker.stage, "error": error}


def _ended(worker: _Worker) -> None:
    with suppress(OSError):
        worker.connection.send(None)
    worker.process.join(10.0)
    if worker.process.is_alive():
        worker.process.kill()


def _serve(connection: Connection, run: Run, limits: Limits) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its workers
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    memory = int(limits.memory_GiB * GIB)
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))

    def report(stage: str, line: Line) -> None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        soft = int(used.ru_utime + used.ru_stime + limits.cpu_s) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.RLIM_INFINITY))
        connection.send(("stage", stage, line))

    try:
        while (task := connection.recv()) is not None:
            report("start", {})
            connection.send(("done", "", run(task, report)))
    except (EOFError, BrokenPipeError):
        return  # the parent is gone
