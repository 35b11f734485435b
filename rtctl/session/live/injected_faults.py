"""Faults that a scenario injects into the line of its device, as events of the run: what was done, not what it did."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, runtime_checkable

from rtctl.border.records import Driver
from rtctl.loop.events import Events
from rtctl.session.run_folder import Recording

INJECTED = "injected"
"""Kind of these events. A replay has no use for them: what they did stands in the readings."""
EVERY_S = 1.0
"""The first fault of a kind is noted when it strikes, later ones together, once in this time [s]."""


def bursts_struck(more: int, before: int) -> str:
    """Return `3 bursts of bytes struck by chance, 5 so far`, of which there were some `before`."""
    words = f"{more} {'burst' if more == 1 else 'bursts'} of bytes struck by chance"
    return f"{words}, {before + more} so far" if before else words


@runtime_checkable
class InjectsFaults(Protocol):
    """A driver whose line has faults on purpose."""

    on_injected: Callable[[str], None]
    """Is called with the kind of each fault when it strikes, in a thread of the driver's own."""


class InjectedFaults:
    """Notes faults; called from one thread at a time."""

    def __init__(
        self, events: Events, count_rows: Callable[[], int], now_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._events, self._count_rows, self._now_s = events, count_rows, now_s
        self._noted: Counter[str] = Counter()
        self._waiting: Counter[str] = Counter()
        self._next_s: dict[str, float] = {}

    def struck(self, kind: str) -> None:
        """Count a fault that strikes now, and note those of its kind where the last note is old enough."""
        self._waiting[kind] += 1
        if self._now_s() >= self._next_s.get(kind, 0.0):
            self._note(kind)

    def finish(self) -> None:
        """Note what was not noted yet."""
        for kind in tuple(+self._waiting):
            self._note(kind)

    def _note(self, kind: str) -> None:
        more = self._waiting.pop(kind)
        before, self._noted[kind] = self._noted[kind], self._noted[kind] + more
        self._next_s[kind] = self._now_s() + EVERY_S
        message = bursts_struck(more, before)
        self._events.note(self._count_rows(), INJECTED, fault=kind, message=message, count=more)


@contextmanager
def noted_faults(driver: Driver, recording: Recording) -> Iterator[None]:
    """Note the faults that an open driver injects while the block runs, at the end of which it is closed."""
    if not isinstance(driver, InjectsFaults):
        yield
        return
    faults = InjectedFaults(recording.events, lambda: len(recording.signals))
    driver.on_injected = faults.struck
    try:
        yield
    finally:
        driver.on_injected = lambda kind: None
        faults.finish()
