"""Latency: the shortest period that a machine and a wire hold.

The loop runs, recording on, at shorter and shorter periods and plays the safe level through the driver. There is no
estimator and no controller; `rtctl run` reports their compute time. A period holds if at most one in a thousand was
missed and all but one in a hundred steps (lateness, round trip and compute together) took less than four fifths of it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.errors import DriverError, Fault, RunError
from rtctl.registry import DEFAULT_PLANT, names, plant_kind
from rtctl.scenario.instruments import FASTEST_LINE_HZ, PLACES
from rtctl.scenario.schema import Scenario, checked_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.session.run_folder import RunFolder
from rtctl.timing.histogram import Histogram
from rtctl.timing.realtime import Request
from rtctl.timing.step_timing import StepTiming
from rtctl.wiring import build_driver

PERIODS_S = (10e-3, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
PERIODS_OF_KIND_S = {"scpi": (50e-3, 20e-3, 10e-3, 5e-3, 2e-3)}
"""Where a kind of driver is slower: a reading of an instrument takes milliseconds."""
LARGEST_MISSED_SHARE = 1e-3
LARGEST_SHARE_OF_PERIOD = 0.8
LEAST_STEPS = 200
SERVED = {"modbus-tcp": "--modbus-tcp", "modbus-rtu": "--modbus-rtu", "serial": "--serial", "scpi": "--scpi"}
ADDRESS_KEY = {"modbus-tcp": "address", "modbus-rtu": "port", "serial": "port", "scpi": "address"}
SERVED_KEYS: dict[str, dict[str, Any]] = {
    "scpi": {"table": "keithley-2450", "compliance_voltage": "20 V", "nplc": 0.1}
}
"""Further keys of the driver of a device that is served here."""
SERVED_DEVICE = {"scpi": "vo2_slow"}
"""What is served, where it is not the default device."""
Report = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """The measurement of one driver at one period."""

    period_s: float
    timing: StepTiming
    fault: Fault | None
    message: str
    requests: Sequence[Request]
    """What came of each real-time request."""

    @property
    def periods(self) -> int:
        """The number of periods, taken or missed."""
        return self.timing.steps + self.timing.overruns

    @property
    def busy_us(self) -> float:
        """The 99th percentiles of lateness, round trip and compute time, added up [us]."""
        timing = self.timing
        parts = (timing.lateness, timing.round_trip, timing.compute)
        return 1e-3 * sum(part.quantile_ns(0.99) for part in parts)

    @property
    def holds(self) -> bool:
        """Whether this machine and wire hold the period."""
        if self.fault is not None or self.timing.steps == 0:
            return False
        missed = self.timing.overruns <= LARGEST_MISSED_SHARE * self.periods
        return missed and self.busy_us <= LARGEST_SHARE_OF_PERIOD * 1e6 * self.period_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Ladder:
    """The measurements of one driver at all periods that were tried, from long to short."""

    kind: str
    where: str
    rungs: tuple[Rung, ...]

    @property
    def held(self) -> Rung | None:
        """The shortest period before the first one that did not hold; None: not even the longest."""
        best = None
        for rung in self.rungs:
            if not rung.holds:
                break
            best = rung
        return best


def measure(
    kind: str,
    tables: dict[str, Any],
    periods_s: Sequence[float],
    duration_s: float,
    stop_requested: Callable[[], bool],
    report: Report,
) -> Ladder:
    """Measure one driver at shorter and shorter periods, until two in a row do not hold.

    A simulated device is served by another process if the driver's table does not say where one is.

    Args:
        kind: kind of the driver.
        tables: `driver` and `clock` of a scenario.
        periods_s: the periods [s].
        duration_s: how long each is measured [s].
        stop_requested: returns True once the measurement is to end.
        report: takes a line of progress after each period.

    Raises:
        RtctlError: no device answers, or it fails.
    """
    clock = tables.get("clock", {})
    with served_device(kind, tables.get("driver", {}), clock.get("priority")) as (driver_table, where):
        rungs: list[Rung] = []
        reading_s = float(driver_table.get("nplc", 0.0)) / FASTEST_LINE_HZ
        for period_s in sorted((period for period in periods_s if period >= reading_s), reverse=True):
            scenario = latency_scenario(driver_table, clock, period_s)
            rung = measure_period(scenario, duration_s, stop_requested)
            rungs.append(rung)
            report(f"{kind} at {1e3 * period_s:g} ms: {'holds' if rung.holds else 'does not hold'}")
            if rung.fault is Fault.INTERRUPTED or [r.holds for r in rungs[-2:]] == [False, False]:
                break
    return Ladder(kind=kind, where=where, rungs=tuple(rungs))


def latency_scenario(driver: dict[str, Any], clock: dict[str, Any], period_s: float) -> Scenario:
    """Return a scenario that plays the safe level, live. Raises InputError."""
    tables = {
        "scenario": {"title": "latency", "period": f"{period_s!r} s"},
        "driver": driver,
        "clock": {"mode": "live", "settle": "0 s", **clock},
        "excitation": [{"kind": "levels", "levels": ["0 %", "0 %"], "hold": "1 s"}],
    }
    return checked_scenario(tables, "rtctl latency")


def measure_period(scenario: Scenario, duration_s: float, stop_requested: Callable[[], bool]) -> Rung:
    """Run the loop for `duration_s` [s] at the period of `scenario`. Raises RtctlError."""
    period_s = scenario.scenario.period_s
    steps = max(round(duration_s / period_s), LEAST_STEPS)
    levels = np.full(steps, scenario.limits.safe_level)
    driver = build_driver(scenario, Path())
    with tempfile.TemporaryDirectory(prefix="rtctl-latency-") as folder:
        place = RunFolder(path=Path(folder), metadata={}, model=None)
        first = open_driver(driver, scenario)
        try:
            run = play(scenario, driver, levels, first, stop_requested, place)
        except DriverError as error:
            raise RunError(str(error)) from None
    return Rung(
        period_s=period_s,
        timing=run.timing,
        fault=run.outcome.fault,
        message=run.outcome.message,
        requests=run.requests,
    )


def known_kinds() -> list[str]:
    """Return the kinds of drivers that can be measured here."""
    return [kind for kind in names("driver") if kind == "inprocess" or kind in SERVED]


@contextmanager
def served_device(
    kind: str, table: dict[str, Any], priority: int | None
) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield the driver's table with the address of a device, and where that is, in words.

    A real device has a processor of its own; a simulated one gets the loop's `priority` instead, as far as permitted.
    """
    if kind == "inprocess":
        yield {"kind": kind, **table}, "in this process"
        return
    if (given := next((key for key in PLACES if key in table), None)) is not None:
        yield {"kind": kind, **table}, f"at {table[given]}"
        return
    key = ADDRESS_KEY[kind]
    with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
        place = "127.0.0.1:0" if key == "address" else str(Path(folder) / "port")
        device = SERVED_DEVICE.get(kind) or str(plant_kind(DEFAULT_PLANT).defaults.device)
        command = [sys.executable, "-m", "rtctl", "serve", device, SERVED[kind], place, "--seed", "1"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
            try:
                assert process.stdout is not None
                words = process.stdout.readline().split()
                if words[:1] != ["ready"]:
                    raise RunError(f"the simulated device for {kind} did not start")
                if priority is not None:
                    with suppress(OSError):
                        for task in os.listdir(f"/proc/{process.pid}/task"):
                            os.sched_setscheduler(int(task), os.SCHED_FIFO, os.sched_param(priority))
                served = {"kind": kind, key: words[2], **SERVED_KEYS.get(kind, {}), **table}
                yield served, "served by another process here"
            finally:
                process.terminate()


def cyclictest(period_s: float, duration_s: float, priority: int | None) -> Histogram | None:
    """Measure wake-up lateness by `cyclictest` at the same period and priority; None if it is not installed."""
    program = shutil.which("cyclictest")
    if program is None:
        return None
    loops = max(round(duration_s / period_s), LEAST_STEPS)
    scheduling = ["--policy=other"] if priority is None else [f"--priority={priority}", "--mlockall"]
    command = [program, "--quiet", "--threads=1", f"--interval={round(1e6 * period_s)}", f"--loops={loops}",
               "--histogram=100000", *scheduling]  # fmt: skip
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        return None
    histogram = Histogram()
    for line in ended.stdout.splitlines():
        words = line.split()
        if len(words) == 2 and words[0].isdigit() and words[1].isdigit():
            histogram.record_many(1000 * int(words[0]), int(words[1]))
    return histogram if histogram.count else None
