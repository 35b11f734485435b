"""Processor time less the compiler's: a kernel is compiled once on a machine, and no answer is to depend on it."""

from __future__ import annotations

import threading
import time

from numba.core.event import Event, Listener, register


class _Compiling(Listener):
    """Adds up what compilations take in the threads that ask for them; one within another counts once."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._lock = threading.Lock()
        self._own = threading.local()

    def on_start(self, event: Event) -> None:
        depth = getattr(self._own, "depth", 0)
        if depth == 0:
            self._own.begun = time.thread_time()
        self._own.depth = depth + 1

    def on_end(self, event: Event) -> None:
        self._own.depth -= 1
        if self._own.depth == 0:
            with self._lock:
                self.seconds += time.thread_time() - self._own.begun


_COMPILING = _Compiling()
register("numba:compile", _COMPILING)  # type: ignore[no-untyped-call]


def working_time() -> float:
    """[s] Of the process since it began, less all compilations since this module was imported."""
    return time.process_time() - _COMPILING.seconds
