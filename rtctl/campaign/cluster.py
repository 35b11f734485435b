"""Parts on a Dask cluster: workers come, go and are killed; a part lost with one is computed by another.

A task is a part: seconds of work, a few kB to send and to return, so the scheduler's millisecond is no overhead.
Results travel to this process, which alone writes: workers need `rtctl[cluster]` of the same version and no disk.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import urlsplit

from rtctl.border.errors import InputError, RunError
from rtctl.campaign.part import compute_part
from rtctl.campaign.plan import Plan
from rtctl.extras import require
from rtctl.version import __version__

WAITING = 2
"""Parts submitted for each thread of the workers."""
MOST_LOSSES = 5
"""Losses of one part, by the scheduler's count of killed workers, above which the part itself is at fault."""
NO_WORKER_S = 60.0
CONNECT_S = 10.0


def on_cluster(plan: Plan, numbers: Sequence[int], address: str) -> Iterator[tuple[int, bytes]]:
    """Yield each part's number and content as it is done. Raises InputError and RunError."""
    _check_address(address)
    distributed: Any = require("distributed", "--scheduler")
    connect: Any = distributed.Client
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client: Any = connect(address, timeout=CONNECT_S)
    except (OSError, TimeoutError):
        raise RunError(f"--scheduler {address}: no Dask scheduler answers there") from None
    try:
        yield from _Run(plan, client, address, distributed).parts(numbers)
    finally:
        client.close(timeout=CONNECT_S)


def version_here() -> str:
    """Return the version of rtctl on a worker."""
    return __version__


class _Run:
    """Tasks of one campaign on a cluster."""

    def __init__(self, plan: Plan, client: Any, address: str, distributed: Any) -> None:
        self._plan, self._client, self._address, self._dask = plan, client, address, distributed
        self._pending: dict[Any, int] = {}
        self._losses: dict[int, int] = {}
        self._seen = time.monotonic()

    def parts(self, numbers: Sequence[int]) -> Iterator[tuple[int, bytes]]:
        self._check_versions()
        queue = list(reversed(numbers))
        while queue or self._pending:
            room = WAITING * max(1, self._threads()) - len(self._pending)
            for _ in range(min(room, len(queue))):
                self._submit(queue.pop())
            yield from self._done()

    def _submit(self, number: int) -> None:
        key = f"rtctl-{self._plan.fingerprint[:12]}-{number}-{self._losses.get(number, 0)}"
        self._pending[self._client.submit(compute_part, self._plan, number, key=key)] = number

    def _done(self) -> Iterator[tuple[int, bytes]]:
        try:
            finished = self._dask.wait(list(self._pending), timeout=1.0, return_when="FIRST_COMPLETED").done
        except (TimeoutError, self._dask.TimeoutError):
            self._check_alive()
            return
        for future in finished:
            number = self._pending.pop(future)
            try:
                content: bytes = future.result(timeout=NO_WORKER_S)
            except (self._dask.scheduler.KilledWorker, self._dask.CancelledError, TimeoutError, OSError):
                self._lost(number)
                continue
            yield number, content
            future.release()

    def _lost(self, number: int) -> None:
        """Resubmit a part whose workers were killed, unless it is the part that kills them."""
        self._check_alive()
        self._losses[number] = self._losses.get(number, 0) + 1
        if self._losses[number] > MOST_LOSSES:
            raise RunError(
                f"part {number} was lost with its workers {MOST_LOSSES} times over; is there memory enough on them?"
            )
        self._submit(number)

    def _threads(self) -> int:
        return sum(int(count) for count in self._client.nthreads().values())

    def _check_alive(self) -> None:
        """Raise RunError where no worker can be active."""
        try:
            working = self._client.status == "running" and self._threads() > 0
        except (OSError, TimeoutError):
            working = False
        now = time.monotonic()
        if working:
            self._seen = now
        elif now - self._seen > NO_WORKER_S:
            raise RunError(
                f"--scheduler {self._address}: no worker there for {NO_WORKER_S:g} s; what is done is kept, start "
                "workers and give the same command to go on"
            )

    def _check_versions(self) -> None:
        """Raise RunError where a worker runs another version, which might compute other results."""
        try:
            found: dict[str, str] = self._client.run(version_here)
        except ModuleNotFoundError as error:
            raise RunError(
                f"--scheduler {self._address}: a worker has no module {error.name}; install rtctl there"
            ) from None
        for worker, version in found.items():
            if version != __version__:
                raise RunError(
                    f"--scheduler {self._address}: worker {worker} has rtctl {version}, here is {__version__}; "
                    "results would not be the same, install one version"
                )


def _check_address(address: str) -> None:
    parts = urlsplit(address)
    try:
        complete = parts.scheme in ("tcp", "tls", "ws", "wss") and parts.hostname and parts.port
    except ValueError:
        complete = None
    if not complete:
        raise InputError(f'--scheduler "{address}": an address such as tcp://HOST:8786 is needed')
