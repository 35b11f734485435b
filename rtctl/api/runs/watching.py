"""A run that a person watches: a bar over its steps, and Ctrl-C that ends it after the exchange under way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.progress import Reporter

STEPS_OF_A_REPORT = 250
"""Exchanges between two updates of the bar."""


@contextmanager
def watched_run(title: str, steps: int, report: Reporter) -> Iterator[Callable[[], bool]]:
    """Yield what the loop asks once an exchange: whether to stop; the bar counts how often it asked."""
    with stop_on_interrupt() as stop_requested, report.bar(title, steps) as advance:
        done = 0

        def ask() -> bool:
            nonlocal done
            done += 1
            if done % STEPS_OF_A_REPORT == 0:
                advance(done)
            return stop_requested()

        yield ask
