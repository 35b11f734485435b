"""How a run goes while it lasts: set-point, estimate, error and lateness, from the rows that it records.

A thread of its own looks at the files; the loop does nothing for it and waits for nothing.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from rtctl.border.errors import InputError
from rtctl.output.live_line import Show
from rtctl.output.readable_units import readable
from rtctl.recording.tail import Tail
from rtctl.scenario.schema import Scenario
from rtctl.session.run_folder import SIGNALS, TIMING

LOOK_EVERY_S = 0.25
DIGITS = 4


class StatusReader:
    """Reads the newest rows of a run's recordings."""

    def __init__(self, folder: Path, scenario: Scenario, steps: int) -> None:
        """Prepare to read the run of `steps` samples that records into `folder`."""
        self._folder, self._steps = folder, max(steps, 1)
        self._live = scenario.clock.mode == "live"
        self._output, self._closed = scenario.profile.reference, scenario.reference is not None
        self._old = _inode(folder / SIGNALS)
        """Of a run that was killed: its recording is moved aside when this one begins."""
        self._signals: Tail | None = None
        self._timing: Tail | None = None

    def look(self) -> tuple[float, str] | None:
        """Return the share that is done and a line; None where nothing new was recorded."""
        if self._signals is None or self._timing is None:
            if _inode(self._folder / SIGNALS) in (None, self._old) or not (self._folder / TIMING).is_file():
                return None
            self._signals = self._signals or Tail(self._folder / SIGNALS)
            self._timing = Tail(self._folder / TIMING)
        rows, times = self._signals.new_rows(), self._timing.new_rows()
        if not len(rows["index"]):
            return None
        last = {name: float(values[-1]) for name, values in rows.items()}
        parts = self._values(last)
        if self._live and len(times["lateness"]):
            parts.append(f"late {readable(1e-6 * float(np.max(times['lateness'])), 's', 3)}")
        return (last["index"] + 1.0) / self._steps, ", ".join(parts)

    def _values(self, last: dict[str, float]) -> list[str]:
        """Return set-point, estimate and error: against the instrument where there is one, else the estimate's."""
        unit, estimate, measured = self._output.unit, last["estimate"], last[self._output.name]
        wanted = last["setpoint"] if self._closed else estimate
        error = wanted - (measured if math.isfinite(measured) else estimate)
        named = {"setpoint": wanted if self._closed else math.nan, "estimate": estimate}
        said = [f"{name} {value:.{DIGITS}g}" for name, value in named.items() if math.isfinite(value)]
        said += [f"error {error:.2g}"] if math.isfinite(error) else []
        return [*said[:-1], f"{said[-1]} {unit}"] if said else []

    def close(self) -> None:
        """Close the files."""
        for tail in (self._signals, self._timing):
            if tail is not None:
                tail.close()


def _inode(path: Path) -> int | None:
    try:
        return path.stat().st_ino
    except OSError:
        return None


@contextmanager
def live_status(folder: Path, scenario: Scenario, steps: int, show: Show) -> Iterator[None]:
    """Show how the run in `folder` goes while the block lasts."""
    reader, ended = StatusReader(folder, scenario, steps), threading.Event()

    def watch() -> None:
        while not ended.wait(LOOK_EVERY_S):
            with suppress(InputError, OSError):  # before its first row, or after its end
                seen = reader.look()
                if seen is not None:
                    show(*seen)

    thread = threading.Thread(target=watch, name="status", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        reader.close()
