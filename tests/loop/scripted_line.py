"""A line that follows a script in Python and compiled alike, so that the loop can be taken over it either way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.border.errors import DriverError, Fault
from rtctl.border.kernels import background_kernel, first_class
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire.wire_memory import (
    COUNTER,
    IN_FORCE,
    LINE_SIZE,
    SEQUENCE,
    STATUS,
    TIME_US,
    CompiledExchange,
    Ended,
    wire_memory,
)

WIDTH = 7
"""Numbers of an exchange: how it ends, counter, time, number in force, status; bits of reading and reference."""


@background_kernel
def played(levels: Any, reading: Any, line: Any, out: Any, inbox: Any) -> int:
    """The next row of the script, which lies behind the line's own numbers; the command goes behind the script."""
    k = line[SEQUENCE]
    line[SEQUENCE] = k + 1
    floats = line.view(np.float64)
    at = LINE_SIZE + WIDTH * k
    line[COUNTER], line[TIME_US], line[IN_FORCE], line[STATUS] = (
        line[at + 1],
        line[at + 2],
        line[at + 3],
        line[at + 4],
    )
    reading[0], reading[1] = floats[at + 5], floats[at + 6]
    rows = (line.size - LINE_SIZE) // (WIDTH + 1)
    floats[LINE_SIZE + WIDTH * rows + k] = levels[0]
    ended: int = line[at]
    return ended


_PLAYED: list[Any] = []


class ScriptedLine:
    """A driver whose answers are written down beforehand: measurements, or how an exchange ends."""

    profile, identity = VO2, "SCRIPT"

    def __init__(self, answers: Sequence[Measurement | Ended]) -> None:
        rows = len(answers)
        self._memory = wire_memory(VO2)._replace(
            line=np.zeros(LINE_SIZE + rows * (WIDTH + 1), dtype=np.int64)
        )
        for k, answer in enumerate(answers):
            row = self._memory.line[LINE_SIZE + WIDTH * k :][:WIDTH]
            if isinstance(answer, Ended):
                row[0] = int(answer)
            else:
                row[1:5] = answer.counter, answer.time_us, answer.sequence, answer.status
                row[5:] = np.array([answer.sensed[0], answer.reference]).view(np.int64)
        self._rows = rows
        self.closed_with: list[tuple[float, ...]] = []

    @property
    def commands(self) -> list[float]:
        """What has been sent."""
        sent = self._memory.line[LINE_SIZE + WIDTH * self._rows :][: int(self._memory.line[SEQUENCE])]
        return sent.view(np.float64).tolist()

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        raise AssertionError

    def exchange(self, levels: Sequence[float]) -> Measurement:
        self._memory.levels[0] = levels[0]
        return self.conclude(played(*self._memory), levels)

    def conclude(self, ended: int, levels: Sequence[float]) -> Measurement:
        if ended != Ended.OK:
            raise DriverError(Fault.NO_ANSWER, f"ended as {ended} after {levels[0]!r}")
        *sensed, reference = self._memory.reading.tolist()
        return Measurement(tuple(sensed), reference, *self._memory.line[COUNTER : STATUS + 1].tolist())

    def compiled_exchange(self) -> CompiledExchange:
        if not _PLAYED:
            _PLAYED.append(first_class(played, *wire_memory(VO2)))
        return CompiledExchange(_PLAYED[0], self._memory, self.conclude)

    def close(self, safe_levels: Sequence[float]) -> None:
        self.closed_with.append(tuple(safe_levels))
