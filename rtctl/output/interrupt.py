"""Ctrl-C, SIGTERM and SIGHUP as a request to stop: what is done by then is kept."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stop_on_interrupt(cancel: Callable[[], None] = lambda: None) -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C, SIGTERM and SIGHUP ask for an end after the step under way, and call `cancel`.

    Yields a function that says whether a stop was requested. A second Ctrl-C or SIGTERM is immediate. A terminal that
    is closed sends SIGHUP, often twice; under `nohup` it stays ignored. Signals reach the main thread only:
    elsewhere the function always says False.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    requested = False

    def request(number: int, frame: FrameType | None) -> None:
        nonlocal requested
        if requested and number != signal.SIGHUP:
            raise KeyboardInterrupt
        requested = True
        cancel()

    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, request) for number in numbers}
    try:
        yield lambda: requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
