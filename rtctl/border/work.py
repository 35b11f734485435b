"""Simulated work, counted where it is done: the same number for the same computation on every machine.

A simulation reports its integration steps with `count_work`. Whoever wants the sum opens `metered()` around the
computation; threads that are started within pass the meter on with `adopt_meter`. Without a meter nothing is counted.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class WorkMeter:
    """Sum of the work that simulations report, in steps (lanes x samples x steps a sample); safe across threads."""

    def __init__(self) -> None:
        self._steps = 0
        self._lock = threading.Lock()

    @property
    def steps(self) -> float:
        """Return the steps counted since the meter was made."""
        return self._steps

    def add(self, steps: float) -> None:
        """Count `steps` more."""
        with self._lock:
            self._steps += round(steps)  # whole numbers: their sum does not depend on the order of threads


_METER: ContextVar[WorkMeter | None] = ContextVar("work_meter", default=None)


def count_work(steps: float) -> None:
    """Add `steps` to the meter of this thread, if there is one."""
    meter = _METER.get()
    if meter is not None:
        meter.add(steps)


def current_meter() -> WorkMeter | None:
    """Return the meter of this thread, or None where nothing is counted."""
    return _METER.get()


def adopt_meter(meter: WorkMeter | None) -> None:
    """Count this thread's work on `meter`; the initializer of a pool's threads."""
    _METER.set(meter)


@contextmanager
def metered() -> Iterator[WorkMeter]:
    """Count all work within the block on a new meter; yields it."""
    meter = WorkMeter()
    token = _METER.set(meter)
    try:
        yield meter
    finally:
        _METER.reset(token)
