"""A simulated device that is served with faults, or with a page of its own that shows what it really does."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.scenario.serving import ServedAt, ServedFaults
from rtctl.session.bench.account import Accounted, bench_account
from rtctl.wiring_served import build_bench, serve_bench

PR_SET_PDEATHSIG = 1
"""prctl: the signal that a process gets when its parent ends (linux/prctl.h)."""
END_WITHIN_S = 10.0


def serve_on_bench(
    device: str,
    seed: int | None,
    where: ServedAt,
    *,
    faults: ServedFaults,
    record: Path | None,
    page: int | None,
    has_page: bool,
) -> None:
    """Serve a device until interrupted.

    Args:
        device: Plant file, or the name of a bundled one.
        seed: Seed of its noise; None: its own.
        where: Its wires.
        faults: What goes wrong.
        record: Folder for what it really does; None: with a page a folder that is removed at the end, else none.
        page: Port of the page; 0: a free one; None: the usual one, or a free one where that is taken.
        has_page: Whether there is a page.

    Raises:
        InputError: there is no such device, or it cannot be served there.
    """
    with ExitStack() as stack:
        folder = record
        if folder is None and has_page:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rtctl-bench-")))
        page_process = None
        if has_page:
            assert folder is not None
            folder.mkdir(parents=True, exist_ok=True)
            page_process = stack.enter_context(page_of(folder, page))  # it starts while the device is made
        bench = build_bench(
            device, seed, faults, has_journal=where.journal is not None, is_inspected=folder is not None
        )
        if page_process is not None:
            print(f"page {address_of(page_process)}", flush=True)
        if folder is not None:
            _keep_account(bench, folder, stack)
        serve_bench(bench, where)


def _keep_account(bench: Any, folder: Path, stack: ExitStack) -> None:
    """Let a `plant_sim.bench.under_way.Bench` keep its account in `folder`, and be changed from there."""
    device = bench.device
    of = Accounted(
        title=f"{device.identity}: what it really does", period_s=bench.period_s, columns=device.columns,
        inputs=[one.name for one in device.profile.commands], units=bench.units, judge=bench.check,
        values=bench.values,
    )  # fmt: skip
    account = stack.enter_context(bench_account(folder, of))
    device.account, bench.note, bench.changes = account.row, account.note, account.changes
    stack.callback(bench.tell_of_chance, 0.0)  # what has struck since the last word


@contextmanager
def page_of(folder: Path, port: int | None) -> Iterator[subprocess.Popen[str]]:
    """Serve the page of `folder` by a process of its own inside the block; yield the process.

    Another process, because the device answers its host in microseconds, which a page would make milliseconds.
    """
    command = [sys.executable, "-m", "rtctl", "watch", str(folder), "--control", "--quiet"]
    command += [] if port is None else ["--port", str(port)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=_end_with_parent
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.communicate(timeout=END_WITHIN_S)


def address_of(page: subprocess.Popen[str]) -> str:
    """Return the address of a page once it is served. Raises InputError where it cannot be."""
    assert page.stdout is not None
    assert page.stderr is not None
    address = page.stdout.readline().strip()
    if not address:
        said = page.stderr.read().strip().splitlines() or ["the page has ended"]
        raise InputError(said[-1].removeprefix("rtctl watch: ").replace("--port", "--page"))
    return address


def _end_with_parent() -> None:
    """Let the kernel end this process with its parent, also where that is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
