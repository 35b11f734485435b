"""Devices behind a real wire: a served process, and one served from a thread whose device a test can look into."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires, served
from rtctl.border.records import Measurement
from rtctl.wiring import load_plant


class Served(NamedTuple):
    """A device in a process of its own."""

    process: subprocess.Popen[str]
    settings: list[str]
    """`--set` options that lead a scenario's driver to it."""


@contextmanager
def served_process(device: str, wire: str, folder: Path, seed: int = 7) -> Iterator[Served]:
    """`rtctl serve` of a bundled device; `wire` is a kind of driver."""
    where = [f"--{wire}", "127.0.0.1:0" if wire == "modbus-tcp" else str(folder / "port")]
    command = [sys.executable, "-m", "rtctl", "serve", device, *where, "--seed", str(seed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            words = process.stdout.readline().split()
            assert words[0] == "ready", words
            key = "address" if wire == "modbus-tcp" else "port"
            yield Served(process, settings(f"driver.kind={wire}", f"driver.{key}={words[2]}"))
        finally:
            process.kill()


def settings(*values: str) -> list[str]:
    """`--set` before each."""
    return [word for value in values for word in ("--set", value)]


class WatchedDevice(SimulatedDevice):
    """A simulated device that keeps its commands and says when it has had `enough` of them."""

    def __init__(self, enough: int = 1) -> None:
        super().__init__(load_plant(bundled_plant("vo2_a"), seed=7))
        self.commands: list[float] = []
        self.has_enough = threading.Event()
        self._enough = enough

    def command(self, levels: Sequence[float], sequence: int) -> None:
        """As a device does."""
        super().command(levels, sequence)
        self.commands.append(levels[0])
        if len(self.commands) >= self._enough:
            self.has_enough.set()

    def exchange(self, levels: Sequence[float], sequence: int) -> Measurement:
        """As a device does, where a faster path leaves out `command`."""
        before = len(self.commands)
        reading = super().exchange(levels, sequence)
        if len(self.commands) == before:
            self.commands.append(levels[0])
        return reading


@contextmanager
def served_thread(device: SimulatedDevice) -> Iterator[list[str]]:
    """`device` on TCP from a thread of the test; the `--set` options that lead to it."""
    ready: SimpleQueue[tuple[str, asyncio.AbstractEventLoop, asyncio.Event]] = SimpleQueue()

    async def serve() -> None:
        stop = asyncio.Event()
        async with served(device, Wires(tcp="127.0.0.1:0")) as ends:
            ready.put((ends, asyncio.get_running_loop(), stop))
            await stop.wait()

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    ends, loop, stop = ready.get(timeout=20.0)
    try:
        yield settings("driver.kind=modbus-tcp", f"driver.address={ends.split()[1]}")
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(20.0)
        assert not thread.is_alive()


def signals_of(folder: Path) -> dict[str, NDArray[np.float64]]:
    """The recorded signals of a run."""
    table = pq.read_table(folder / "signals.parquet")
    return {name: table[name].to_numpy() for name in table.column_names}


def summary_of(folder: Path) -> dict[str, Any]:
    """The summary of a run."""
    content: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return content
