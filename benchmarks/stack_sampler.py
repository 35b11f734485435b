"""Where processor time goes: the stack is looked at every few milliseconds of it, and the time since is put down to it.

A compiled kernel ends before the stack is seen, so its time counts for the Python function that called it. Nothing is
slowed down or replaced. Only the main thread's stack is seen: what others compute meanwhile counts for what it awaits.
"""

from __future__ import annotations

import signal
import time
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import NamedTuple, Self

EVERY_S = 0.005


class Place(NamedTuple):
    """A frame of the stack."""

    file: str
    function: str


Stack = tuple[Place, ...]
"""Outermost first."""
Labeller = Callable[[Stack], str]


class StackSampler:
    """Sums processor seconds by one or more labels of the stack, within `with`; main thread only."""

    def __init__(self, **labellers: Labeller) -> None:
        self.seconds: dict[str, Counter[str]] = {name: Counter() for name in labellers}
        self._labellers = labellers
        self._last_s = 0.0

    def __enter__(self) -> Self:
        self._last_s = time.process_time()
        self._before = signal.signal(signal.SIGPROF, self._sample)
        signal.setitimer(signal.ITIMER_PROF, EVERY_S, EVERY_S)
        return self

    def __exit__(self, *error: object) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, self._before)

    def _sample(self, number: int, frame: FrameType | None) -> None:
        now_s = time.process_time()
        spent_s, self._last_s = now_s - self._last_s, now_s
        places = []
        while frame is not None:
            code = frame.f_code
            places.append(Place(code.co_filename, code.co_name))
            frame = frame.f_back
        stack = tuple(places[::-1])
        for name, label in self._labellers.items():
            self.seconds[name][label(stack)] += spent_s


def deepest(functions: dict[str, str], otherwise: str) -> Labeller:
    """Return the labeller by the innermost function that stands in `functions` (name: label)."""

    def label(stack: Stack) -> str:
        return next(
            (functions[one.function] for one in reversed(stack) if one.function in functions), otherwise
        )

    return label


def is_compiling(stack: Stack) -> bool:
    """Return whether Numba compiles, or loads what it compiled before."""
    return any("/numba/core/" in one.file for one in stack)


def is_importing(stack: Stack) -> bool:
    """Return whether a module is imported."""
    return any(one.file == "<frozen importlib._bootstrap>" for one in stack)
