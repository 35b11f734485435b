"""A driver whose line has faults on purpose: `drivers.fault_proxy` as a process between it and the device."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import IO

from drivers.fault_proxy import FaultPlan
from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceProfile, Driver, Measurement, SwitchedOff
from rtctl.border.wire.wire_memory import CompiledExchange

NOWHERE = "nowhere:0"
"""Address of a driver that is never opened."""


class FaultyDriver:
    """A driver around another one, with faults on its line; each opening has a line, and a seed, of its own."""

    def __init__(self, make: Callable[[str], Driver], plan: FaultPlan, profile: DeviceProfile) -> None:
        """Wrap the driver that `make` returns for a port or HOST:PORT; a pty's link is chosen here."""
        self.profile = profile
        self.identity = ""
        self.injected: Counter[str] = Counter()
        """What was done so far, by kind."""
        self.on_injected: Callable[[str], None] = lambda kind: None
        """Is called with the kind of each fault when it strikes, in the thread that listens to the line."""
        self._make, self._plan = make, plan
        self._driver: Driver | None = None
        self._line = ExitStack()

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Start the line, then open the driver. Raises DriverError; nothing stays open then."""
        self._end()
        try:
            self._driver = driver = self._make(self._start())
            first = driver.open(
                lockstep_period_us=lockstep_period_us, watchdog_ms=watchdog_ms, timeout_s=timeout_s
            )
        except BaseException:
            self._end()
            raise
        self.identity = driver.identity
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Exchange as the driver does. Raises DriverError."""
        if self._driver is None:
            raise DriverError(Fault.CONNECTION_LOST, "the line with faults is not open")
        return self._driver.exchange(levels)

    def compiled_exchange(self) -> CompiledExchange | None:
        """Return the driver's compiled exchange; before the line is there it is only good for compiling."""
        driver = self._driver or self._make(NOWHERE)
        find = getattr(driver, "compiled_exchange", None)
        exchange: CompiledExchange | None = None if find is None else find()
        return exchange

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff | None:
        """Close the driver, then end the line. Never raises."""
        acknowledged: SwitchedOff | None = SwitchedOff.SILENT
        if self._driver is not None:
            acknowledged = self._driver.close(safe_levels)
        self._end()
        return acknowledged

    def _start(self) -> str:
        folder = Path(self._line.enter_context(tempfile.TemporaryDirectory()))
        plan = replace(self._plan, link=str(folder / "line"))
        process = self._line.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "drivers.fault_proxy", plan.to_json()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        assert process.stdout is not None
        ready = process.stdout.readline().split()
        if not ready:
            assert process.stderr is not None
            why = process.stderr.read().strip().splitlines() or ["it ended"]
            raise DriverError(
                Fault.CONNECTION_LOST, f"{plan.target}: no line with faults can be put there: {why[-1]}"
            )
        listener = threading.Thread(target=self._listen, args=(process.stdout,), name="injected faults")
        listener.start()
        self._line.callback(self._finish, process, listener)
        return ready[1]

    def _listen(self, report: IO[str]) -> None:
        for line in report:
            kind = line.split()[1]
            self.injected[kind] += 1
            self.on_injected(kind)

    def _finish(self, process: subprocess.Popen[str], listener: threading.Thread) -> None:
        assert process.stdin is not None
        process.stdin.close()  # the line ends with its input
        listener.join()

    def _end(self) -> None:
        self._driver = None
        self._line.close()
        self._plan = replace(self._plan, seed=self._plan.seed + 1)
