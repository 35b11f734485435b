"""Threads for what is independent: the records of a fit, the starts of a fit, directions, and rows of a noise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

from threadpoolctl import threadpool_limits

from rtctl.border.work import adopt_meter, current_meter

A = TypeVar("A")
B = TypeVar("B")


@contextmanager
def open_thread_pool(count: int) -> Iterator[Executor | None]:
    """Open `count` threads for segments or starts, while linear algebra on small matrices keeps to one each."""
    with threadpool_limits(1, "blas"):
        if count < 2:
            yield None
            return
        with ThreadPoolExecutor(count, initializer=adopt_meter, initargs=(current_meter(),)) as executor:
            yield executor


def each(executor: Executor | None, function: Callable[[A], B], items: Iterable[A]) -> list[B]:
    """Return what a function makes of each item, in order, in parallel where there are threads.

    A function must not wait for the same threads.
    """
    return list((executor.map if executor else map)(function, items))
