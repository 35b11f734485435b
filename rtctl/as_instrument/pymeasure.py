"""A running loop as an instrument of PyMeasure, and the adapter that carries its commands.

The adapter takes `NAME?`, answered with the newest value of a signal or gain, `NAME VALUE`, which sets the set-point or
a gain, `setpoint plan`, which goes back to the scenario's, `stop`, and `*IDN?`.
"""

from __future__ import annotations

import math
from collections import deque
from pathlib import Path

from pymeasure.adapters import Adapter
from pymeasure.instruments import Instrument

from rtctl.as_instrument.running_loop import RunningLoop
from rtctl.border.errors import InputError
from rtctl.version import __version__

PLAN = "plan"


class LoopAdapter(Adapter):  # type: ignore[misc, unused-ignore]
    """An adapter whose other end is the run that records into a folder."""

    def __init__(self, run: str | Path) -> None:
        """Attach to a run that is under way; `run`: its folder. Raises InputError."""
        super().__init__()
        self.loop = self.connection = RunningLoop(Path(run))  # `close` closes the connection; the run goes on
        self._answers: deque[str] = deque()

    def flush_read_buffer(self) -> None:
        """Forget answers that were not read."""
        self._answers.clear()

    def _write(self, command: str) -> None:
        text = command.strip()
        name, _, value = text.partition(" ")
        if text == "*IDN?":
            self._answers.append(f"rtctl,loop,{self.loop.folder},{__version__}")
        elif text == "stop":
            self.loop.stop()
        elif text.endswith("?"):
            self._answers.append(repr(self.loop.read(text[:-1])))
        else:
            self.loop.change(name, math.nan if value.strip() == PLAN else _number(text, value))

    def _read(self) -> str:
        if not self._answers:
            raise InputError("nothing was asked, so there is no answer to read")
        return self._answers.popleft()


class LoopInstrument(Instrument):  # type: ignore[misc, unused-ignore]
    """The run behind a `LoopAdapter`."""

    setpoint = Instrument.control(
        "setpoint?",
        "setpoint %.12g",
        """Control the set-point of the loop, in the unit of its output (float).""",
    )
    estimate = Instrument.measurement("estimate?", """Get the newest estimate of the output (float).""")
    kp = Instrument.control(
        "controller.kp?", "controller.kp %.12g", """Control the proportional gain (float)."""
    )
    ki = Instrument.control("controller.ki?", "controller.ki %.12g", """Control the integral gain (float).""")

    def __init__(self, adapter: LoopAdapter, name: str = "rtctl loop") -> None:
        """Take the adapter of a run, and a name."""
        super().__init__(adapter, name, includeSCPI=False)

    def signal(self, name: str) -> float:
        """Return the newest value of a recorded signal. Raises InputError for a name that is none."""
        return float(self.ask(f"{name}?"))

    def follow_plan(self) -> None:
        """Go back to the set-points of the scenario."""
        self.write(f"setpoint {PLAN}")

    def stop(self) -> None:
        """End the run at its safe levels."""
        self.write("stop")


def _number(text: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise InputError(f"{text}: expected NAME VALUE, such as setpoint 30, or NAME?") from None
