"""Faults on one wire, one kind after the other: a served device, a faulty line, the loop, and who is to be believed.

The device keeps a journal of its own (`plant_sim.journal`), below everything that could be wrong about a command; the
verdict on safety is drawn from that alone.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from drivers.fault_line import Disturbance, Kind
from drivers.fault_proxy import FaultPlan
from plant_sim.journal import Entry, read_journal
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceStatus, Driver, Measurement
from rtctl.scenario.command_sequence import command_sequences
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.wiring import build_driver, load_plant

PERIOD_S, TIMEOUT_S, WATCHDOG_S = 10e-3, 100e-3, 200e-3
STEPS = 400
LONGEST_S = 120.0
"""A cell that has not had its faults by then is reported as it is."""

SCENARIO = f"""
[scenario]
title = "fault campaign"
period = {{ value = {PERIOD_S}, unit = "s" }}
any_device = true
[clock]
mode = "live"
settle = "40 ms"
timeout = {{ value = {TIMEOUT_S}, unit = "s" }}
watchdog = {{ value = {WATCHDOG_S}, unit = "s" }}
[[excitation]]
kind = "random_staircase"
hold = "20 ms"
levels = {STEPS // 2}
seed = 1
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """What is done, how often."""

    wire: str
    """A kind of driver."""
    kind: str
    """A kind of fault; "none": the machine's own; "several": more than one at once."""
    struck: tuple[tuple[str, float, float], ...]
    """Kind, rate a burst and duration [s] of each disturbance of the line."""
    quiet_s: float
    count: int
    """Faults to inject; of "none": runs."""
    seed: int


@dataclass(slots=True, kw_only=True)
class Found:
    """What came of a cell."""

    injected: int = 0
    runs: int = 0
    named: dict[str, int] = field(default_factory=dict)
    """Runs that ended early, by fault."""
    refused: dict[str, int] = field(default_factory=dict)
    """Openings that failed, by fault."""
    unnamed: list[str] = field(default_factory=list)
    rows: int = 0
    rows_lost: int = 0
    recovery_s: list[float] = field(default_factory=list)
    """From the last fault before a run ended to the first sound exchange of a run that was opened after it."""
    seconds: float = 0.0


@dataclass(slots=True, kw_only=True)
class Verdict:
    """What the device's journal says of all cells of a wire."""

    unsafe: list[str]
    believed_wrong: int
    """Readings that the loop took and the device never made."""
    commands: int
    readings: int


class Watched:
    """A driver that writes down what passes."""

    def __init__(self, driver: Driver) -> None:
        self.profile, self.identity = driver.profile, ""
        self.sent: set[float] = set()
        self.taken: list[tuple[float, Measurement]] = []
        self._driver = driver

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """As the driver's."""
        first = self._driver.open(
            lockstep_period_us=lockstep_period_us, watchdog_ms=watchdog_ms, timeout_s=timeout_s
        )
        self.identity = self._driver.identity
        self.taken = [(time.monotonic(), first)]
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """As the driver's."""
        self._note(levels)
        reading = self._driver.exchange(levels)
        self.taken.append((time.monotonic(), reading))
        return reading

    def close(self, safe_levels: Sequence[float]) -> None:
        """As the driver's."""
        self._note(safe_levels)
        self._driver.close(safe_levels)

    def _note(self, levels: Sequence[float]) -> None:
        self.sent.add(struct.unpack("f", struct.pack("f", levels[0]))[0])


class Line:
    """The process with the faults, and what it has told."""

    def __init__(self, plan: FaultPlan) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "drivers.fault_proxy", plan.to_json()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self._process.stdout is not None
        self._out = self._process.stdout
        ready = self._out.readline().split()
        if not ready:
            raise RuntimeError("the faulty line did not start")
        self.where = ready[1].decode()
        os.set_blocking(self._out.fileno(), False)
        self._text = b""

    def injected(self) -> list[float]:
        """Times [s] of the faults until now."""
        while data := self._out.read():
            self._text += data
        return [float(line.split()[0]) for line in self._text.splitlines() if line]

    def end(self) -> None:
        """Ends the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(20.0)


@contextmanager
def device(wire: str, folder: Path) -> Iterator[tuple[subprocess.Popen[str], str, Path]]:
    """A served device that writes a journal; where it is."""
    journal = folder / "journal.csv"
    where = "127.0.0.1:0" if wire == "modbus-tcp" else str(folder / "device")
    command = [sys.executable, "-m", "rtctl", "serve", "vo2_a", f"--{wire}", where, "--journal", str(journal)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().split()[2], journal
        finally:
            process.terminate()


def run_wire(cells: Sequence[Cell], folder: Path) -> Iterator[Found | Verdict]:
    """Each cell runs until its faults are injected; then what the device says. All cells are of one wire."""
    file = folder / "scenario.toml"
    file.write_text(SCENARIO, encoding="utf-8")
    wire = cells[0].wire
    sent: set[float] = set()
    taken: list[Measurement] = []
    with device(wire, folder) as (process, target, journal):
        for cell in cells:
            found, begun_s = Found(), time.monotonic()
            line = Line(plan_of(cell, target, folder, process.pid))
            try:
                key = "address" if wire == "modbus-tcp" else "port"
                settings = [f"driver.kind={wire}", f"driver.{key}={line.where}"]
                scenario, _ = load_scenario(file, settings)
                watched = Watched(build_driver(scenario, folder))
                taken += _run_until_struck(cell, scenario, watched, line, found)
                sent |= watched.sent
            finally:
                line.end()
            found.seconds = time.monotonic() - begun_s
            yield found
    yield judged(read_journal(journal), sent, taken, scenario)


def judged(
    entries: Sequence[Entry], sent: set[float], taken: Sequence[Measurement], scenario: Scenario
) -> Verdict:
    """The device's journal against what the host sent and took."""
    made = {(entry.number, entry.values) for entry in entries if entry.event == "reading"}
    return Verdict(
        unsafe=unsafe_entries(entries, sent, scenario.limits.low, scenario.limits.high),
        believed_wrong=sum((reading.counter, reading.sensed) not in made for reading in taken),
        commands=sum(entry.event == "command" for entry in entries),
        readings=len(taken),
    )


def plan_of(cell: Cell, target: str, folder: Path, device_pid: int) -> FaultPlan:
    """The faulty line of a cell."""
    struck = tuple(
        Disturbance(kind=Kind(kind), rate=rate, duration_s=duration_s)
        for kind, rate, duration_s in cell.struck
    )
    return FaultPlan(
        wire="tcp" if cell.wire == "modbus-tcp" else "pty",
        target=target,
        disturbances=struck,
        seed=cell.seed,
        link=str(folder / "line"),
        host_pid=os.getpid(),
        device_pid=device_pid,
        quiet_s=cell.quiet_s,
    )


def _run_until_struck(
    cell: Cell, scenario: Scenario, watched: Watched, line: Line, found: Found
) -> list[Measurement]:
    """Open, run, and again; every reading that was taken."""
    readings: list[Measurement] = []
    named, refused = Counter[str](), Counter[str]()
    fault_s: float | None = None
    end_s = time.monotonic() + LONGEST_S

    def enough() -> bool:
        done = found.runs if cell.kind == "none" else len(line.injected())
        return done >= cell.count or time.monotonic() > end_s

    levels = command_sequences(scenario)[0]
    while not enough():
        watched.taken = []
        try:
            first = open_driver(watched, scenario)
        except DriverError as error:
            refused[str(error.fault)] += 1
            continue
        except InputError as error:  # nothing at the port at present
            refused[str(Fault.CONNECTION_LOST)] += 1
            if not str(error):
                found.unnamed.append("an opening failed without a word")
            time.sleep(0.01)
            continue
        table, outcome, *_ = play(scenario, watched, levels, first, enough)
        found.runs += 1
        if fault_s is not None and len(watched.taken) > 1:
            found.recovery_s.append(watched.taken[1][0] - fault_s)
            fault_s = None
        readings += [reading for _, reading in watched.taken]
        found.rows += len(table["index"])
        under_way = int(outcome.fault is Fault.INTERRUPTED)  # asked to stop, the loop leaves its last answer
        taken = watched.taken[: len(watched.taken) - under_way]
        found.rows_lost += rows_missing(taken, len(table["index"]), scenario)
        if outcome.fault is not None and outcome.fault is not Fault.INTERRUPTED:
            named[str(outcome.fault)] += 1
            struck_s = [at for at in line.injected() if at <= time.monotonic()]
            fault_s = struck_s[-1] if struck_s else watched.taken[-1][0]
            if not outcome.message:
                found.unnamed.append(f"{outcome.fault} without a word")
        elif outcome.fault is None and outcome.steps + outcome.overruns != len(levels):
            found.unnamed.append(f"ended after {outcome.steps} of {len(levels)} steps without a fault")
    found.injected = len(line.injected())
    found.named, found.refused = dict(named), dict(refused)
    return readings


def rows_missing(taken: Sequence[tuple[float, Measurement]], rows: int, scenario: Scenario) -> int:
    """Sound exchanges of a run, after its settling, that have no row."""
    healthy = int(DeviceStatus.ENABLED)
    settling = round(scenario.clock.settle_s / scenario.scenario.period_s)
    sound, previous = 0, taken[0][1] if taken else None
    for _, reading in taken[1:]:
        assert previous is not None
        fresh = 0 < (reading.counter - previous.counter) & 0xFFFFFFFF < 0x80000000
        if reading.status & ~int(DeviceStatus.CLAMPED) != healthy or not fresh:
            break
        sound, previous = sound + 1, reading
    return max(0, sound - settling) - rows


def unsafe_entries(entries: Sequence[Entry], sent: set[float], low: float, high: float) -> list[str]:
    """What the device says that must not have been: sentences, none of a safe one.

    A level at the plant is off, the device's own safe one, or inside the host's limits; it came into force by a command
    that the host has sent as it is; and no command is held for longer than its lease.
    """
    import plant_sim.catalogue as catalogue

    plant = load_plant(catalogue.bundled_plant("vo2_a"))
    resting = {0.0, *plant.safe}
    commands = [entry for entry in entries if entry.event == "command"]
    times = [entry.time_us for entry in commands]
    found = [
        f"command {entry.number} of {entry.values[0]!r} mA at {entry.time_us} us was never sent"
        for entry in commands
        if entry.values[0] not in sent
    ]
    margin = 1e-6 * high
    for entry in entries:
        if entry.event != "applied" or entry.values[0] in resting:
            continue
        level, end_us = entry.values[0], entry.time_us + entry.number
        if not low - margin <= level <= high + margin:
            found.append(f"{level!r} mA at {entry.time_us} us is outside {low} to {high} mA")
        since = max(0, int(np.searchsorted(times, entry.time_us, side="right")) - 1)
        until = int(np.searchsorted(times, end_us, side="left"))
        held_us = max(np.diff([*times[since:until], end_us]), default=end_us)
        if held_us > 1e6 * WATCHDOG_S + 1:
            found.append(f"{level!r} mA, applied until {end_us} us, was not renewed for {held_us} us")
    return found


def main() -> None:
    """A JSON list of cells of one wire on standard input; a JSON line for each and one for the wire."""
    import tempfile

    cells = [Cell(**values) for values in json.loads(sys.stdin.read())]
    with tempfile.TemporaryDirectory() as folder:
        for result in run_wire(cells, Path(folder)):
            print(json.dumps(asdict(result)), flush=True)


if __name__ == "__main__":
    main()
