"""Parts on the cores of this machine, each in its own process."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, get_context, parent_process
from threading import Thread

from rtctl.border.errors import RunError
from rtctl.campaign.part import compute_part
from rtctl.campaign.plan import Plan

WAITING = 2
"""Parts submitted for each worker, so that the next one starts at once."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def on_this_machine(plan: Plan, numbers: Sequence[int], workers: int) -> Iterator[tuple[int, bytes]]:
    """Yield each part's number and content as it is done. Raises RunError where a process dies."""
    workers = min(workers, len(numbers))
    if workers <= 1:
        for number in numbers:
            yield number, compute_part(plan, number)
        return
    context = get_context("forkserver")
    context.set_forkserver_preload(["rtctl.campaign.part"])
    queue = iter(numbers)
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_depend_on_the_parent)
    pending: dict[Future[bytes], int] = {}
    try:
        while True:
            for number in queue:
                pending[pool.submit(compute_part, plan, number)] = number
                if len(pending) >= WAITING * workers:
                    break
            if not pending:
                return
            for done in wait(pending, return_when=FIRST_COMPLETED).done:
                yield pending.pop(done), done.result()
    except BrokenProcessPool:
        raise RunError(
            "a worker process was ended from outside (out of memory?); what is done is kept, the same command goes on"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _depend_on_the_parent() -> None:
    """Leave Ctrl-C to the parent, and end with it: if it was killed, a worker waits for its next part for ever."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_after, args=(parent.sentinel,), daemon=True).start()


def _end_after(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)
