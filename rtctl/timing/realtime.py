"""Real-time requests of a process to the machine; each is applied if permitted, and reported.

SCHED_FIFO, locked memory, a CPU of its own, no sleep states deeper than C0, timers without slack, no garbage
collection. References: `sched(7)`, `mlockall(2)`, `PR_SET_TIMERSLACK` in `prctl(2)`, the kernel's pm_qos_interface.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import NamedTuple

_LOCK_NOW_AND_LATER = 3  # MCL_CURRENT | MCL_FUTURE
_SET_TIMERSLACK, _GET_TIMERSLACK = 29, 30
_LATENCY_FILE = "/dev/cpu_dma_latency"
SWITCH_INTERVAL_S = 2e-5
"""Time after which a computing Python thread yields to the loop's [s]; Python's own 5 ms are five periods."""
NICE_OF_OTHERS = -20
"""Niceness of the process's other threads: one that holds Python's lock must not wait for other programs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RealTime:
    """What to request of the machine."""

    priority: int | None = None
    cpu: int | None = None
    lock_memory: bool = False
    freeze_gc: bool = True


class Request(NamedTuple):
    """A request and what came of it."""

    name: str
    applied: bool
    note: str
    """Why it was not applied; "" if it was."""

    def describe(self) -> str:
        """Return a line of text."""
        return f"{self.name}: {'applied' if self.applied else f'NOT applied, {self.note}'}"


@contextmanager
def real_time(asked: RealTime) -> Iterator[list[Request]]:
    """Apply to this thread and process, and undo at the end. Start helper threads before: they would inherit it."""
    with ExitStack() as undo:
        requests: list[Request] = []
        for name, apply in _requests(asked):
            try:
                undo.callback(apply())
                requests.append(Request(name, True, ""))
            except (OSError, AttributeError, ValueError) as error:
                requests.append(Request(name, False, _reason(error)))
        yield requests


Undo = Callable[[], object]


def _requests(asked: RealTime) -> Iterator[tuple[str, Callable[[], Undo]]]:
    yield "switching threads after 20 us", _short_switch_interval
    if sys.platform == "linux":
        yield "timers without slack", _no_timer_slack
    if asked.freeze_gc:
        yield "garbage collection frozen", _frozen_gc
    if asked.lock_memory:
        yield "memory locked", _locked_memory
    if asked.cpu is not None:
        cpu = asked.cpu
        yield f"CPU {cpu} only", lambda: _on_cpu(cpu)
    if asked.priority is not None:
        priority = asked.priority
        yield f"SCHED_FIFO {priority}", lambda: _fifo(priority)
        yield f"other threads at nice {NICE_OF_OTHERS}", _favoured_threads
        yield "no deep sleep of the CPU", _no_deep_sleep


def _short_switch_interval() -> Undo:
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return lambda: sys.setswitchinterval(before)


def _no_timer_slack() -> Undo:
    before = _libc_call("prctl", _GET_TIMERSLACK, 0, 0, 0, 0)
    _libc_call("prctl", _SET_TIMERSLACK, 1, 0, 0, 0)
    return lambda: _libc_call("prctl", _SET_TIMERSLACK, before, 0, 0, 0)


def _frozen_gc() -> Undo:
    gc.collect()
    gc.freeze()
    was_on = gc.isenabled()
    gc.disable()  # the loop makes no cycles; a collection of what else there is would stop it for milliseconds

    def thaw() -> None:
        gc.unfreeze()
        if was_on:
            gc.enable()

    return thaw


def _locked_memory() -> Undo:
    _libc_call("mlockall", _LOCK_NOW_AND_LATER)
    return lambda: _libc_call("munlockall")


def _on_cpu(cpu: int) -> Undo:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {cpu})
    return lambda: os.sched_setaffinity(0, before)


def _fifo(priority: int) -> Undo:
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    return lambda: os.sched_setscheduler(0, before, parameters)


def _favoured_threads() -> Undo:
    own = threading.get_native_id()
    others = [int(task) for task in os.listdir("/proc/self/task") if int(task) != own]
    before = {task: os.getpriority(os.PRIO_PROCESS, task) for task in others}
    for task in others:
        os.setpriority(os.PRIO_PROCESS, task, NICE_OF_OTHERS)

    def undo() -> None:
        for task, nice in before.items():
            with suppress(OSError):  # it has ended meanwhile
                os.setpriority(os.PRIO_PROCESS, task, nice)

    return undo


def _no_deep_sleep() -> Undo:
    held = os.open(_LATENCY_FILE, os.O_WRONLY)
    os.write(held, (0).to_bytes(4, sys.byteorder))
    return lambda: os.close(held)


def _libc_call(name: str, *arguments: int) -> int:
    libc = ctypes.CDLL(None, use_errno=True)
    answer = int(getattr(libc, name)(*(ctypes.c_ulong(argument) for argument in arguments)))
    if answer < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return answer


def _reason(error: Exception) -> str:
    if isinstance(error, PermissionError):
        return (
            "not permitted (needs root, CAP_SYS_NICE or CAP_IPC_LOCK, or limits in /etc/security/limits.conf)"
        )
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return "this system has no such call" if isinstance(error, AttributeError) else str(error)
