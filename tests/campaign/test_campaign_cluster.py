"""On a Dask cluster whose workers are killed one at a time, the result is the local one to the bit."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest
from campaign_cases import SMALL, campaign

from rtctl.cli import main

pytest.importorskip("distributed")
DASK = [sys.executable, "-W", "ignore", "-m", "dask"]


@pytest.fixture
def processes() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def started(stack: ExitStack, command: list[str], log: Path) -> subprocess.Popen[bytes]:
    """A process that is ended with the test."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with log.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=file, env=environment)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def scheduler(stack: ExitStack, folder: Path) -> str:
    """Its address."""
    log = folder / "scheduler.log"
    running = started(
        stack, [*DASK, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"], log
    )
    deadline = time.monotonic() + 200.0
    while time.monotonic() < deadline and running.poll() is None:
        found = re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text(errors="replace"))
        if found:
            return found[0]
        time.sleep(0.05)
    raise AssertionError(log.read_text())


@pytest.mark.wire
@pytest.mark.slow
def test_four_workers_killed_one_at_a_time_lose_nothing(tmp_path: Path, processes: ExitStack) -> None:
    file = campaign(tmp_path, SMALL.replace("part = 16", "part = 2"))
    address = scheduler(processes, tmp_path)
    worker = [*DASK, "worker", address, "--no-nanny", "--no-dashboard", "--nthreads", "1"]
    workers = [
        started(processes, [*worker, "--local-directory", str(tmp_path / f"w{k}")], tmp_path / f"w{k}.log")
        for k in range(5)  # the last one stays
    ]
    assert main(["sweep", str(file), "--out", str(tmp_path / "local"), "--workers", "1", "--quiet"]) == 0
    out = tmp_path / "cluster"
    for k in range(5):
        wait_for(partial(says, tmp_path / f"w{k}.log", "Registered to"), workers[k])
    sweep = [sys.executable, "-m", "rtctl", "sweep", str(file), "--out", str(out), "--quiet"]
    running = started(processes, [*sweep, "--scheduler", address], tmp_path / "sweep.log")
    kept = out / "parts"
    for k, victim in enumerate(workers[:4]):
        wait_for(partial(enough, kept, 1 + 6 * k), running)
        victim.send_signal(signal.SIGKILL)
        victim.wait()
    assert running.poll() is None, "the campaign was over before the last worker was killed"
    assert running.wait(timeout=400.0) == 0, (tmp_path / "sweep.log").read_text()
    local = {path.name: path.read_bytes() for path in (tmp_path / "local" / "parts").iterdir()}
    assert {path.name: path.read_bytes() for path in kept.iterdir()} == local
    assert len(local) == 42


def says(log: Path, words: str) -> bool:
    return words in log.read_text(errors="replace")


def enough(folder: Path, parts: int) -> bool:
    return len(list(folder.glob("*.parquet"))) >= parts


def wait_for(met: Callable[[], bool], running: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 400.0
    while not met():
        assert running.poll() is None, "ended early"
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.wire
def test_a_scheduler_that_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rtctl.campaign.cluster.CONNECT_S", 0.5)
    file = campaign(tmp_path)
    assert main(["sweep", str(file), "--out", str(tmp_path / "o"), "--scheduler", "tcp://127.0.0.1:1"]) == 1
    assert "no Dask scheduler answers there" in capsys.readouterr().err
