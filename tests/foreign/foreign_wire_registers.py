"""Holding registers of a VO2 actuator (formats.md, "The device on the wire") before a film, and its instruments' noise.

In lockstep each fresh command moves the film by one period. With a free-running clock the film stands still: this bench
has its own clock only for the watchdog.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable

import numpy as np
from foreign_styles import Bench
from foreign_wire_film import Film

COMMANDS, READINGS, IDENTITY = range(8), range(100, 110), range(120, 128)
ENABLED, TRIPPED, CLAMPED, SENSOR_FAULT, REFUSED = (1 << bit for bit in range(5))
ILLEGAL_ADDRESS, ILLEGAL_VALUE = 2, 3
SOURCE_LIMIT_MA = 9.0


class Refusal(Exception):  # noqa: N818 - an answer of the protocol, no error of ours
    """A Modbus exception with its code."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class Registers:
    """The device as a Modbus master sees it; `clock` [s] is the watchdog's."""

    def __init__(
        self, bench: Bench, film: Film, name: str, seed: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._bench, self._film, self._clock = bench, film, clock
        self._noise = np.random.default_rng([79, seed])
        self._name = name.encode("ascii")[:16].ljust(16, b"\0")
        self._written = [0] * len(COMMANDS)
        self._written[6:8] = _words(round(bench.device.period_s * 1e6))
        self._current = 0.0
        self._in_force: int | None = None
        self._status, self._counter, self._time_us = 0, 0, 0
        self._fed: float | None = None
        self._readings = (math.nan, math.nan)
        self._sample(0.0)

    def read(self, first: int, count: int) -> list[int]:
        """`count` registers from `first` on. Raises Refusal."""
        self._look_at_watchdog()
        asked = range(first, first + count)
        if count and asked[0] in COMMANDS and asked[-1] in COMMANDS:
            return self._written[first : first + count]
        if count and asked[0] in READINGS and asked[-1] in READINGS:
            words = self._measured()
            return words[first - 100 : first - 100 + count]
        if count and asked[0] in IDENTITY and asked[-1] in IDENTITY:
            return list(struct.unpack(">8H", self._name))[first - 120 : first - 120 + count]
        raise Refusal(ILLEGAL_ADDRESS)

    def write(self, first: int, words: list[int]) -> None:
        """Write registers from `first` on; all of them or none. Raises Refusal."""
        self._look_at_watchdog()
        if not words or first not in COMMANDS or first + len(words) - 1 not in COMMANDS:
            raise Refusal(ILLEGAL_ADDRESS)
        after = [*self._written]
        after[first : first + len(words)] = words
        current = struct.unpack(">f", struct.pack(">2H", *after[0:2]))[0]
        if not math.isfinite(current) or after[3] > 1 or after[5] > 1 or not any(after[6:8]):
            raise Refusal(ILLEGAL_VALUE)
        touched = range(first, first + len(words))
        self._written = after
        if 3 in touched:
            self._enable(on=bool(after[3]))
        if 2 in touched and after[2] != self._in_force:
            self._command(current, after[2])

    def _enable(self, *, on: bool) -> None:
        if not on:
            self._status &= ~(ENABLED | CLAMPED)
            self._current, self._fed = 0.0, None
        elif not self._status & ENABLED:
            self._status = ENABLED

    def _command(self, current: float, sequence: int) -> None:
        period_us = self._written[6] << 16 | self._written[7]
        one_rate = period_us == round(self._bench.device.period_s * 1e6)  # the only one of this bench
        if self._status & (ENABLED | TRIPPED) != ENABLED or not one_rate:
            self._status |= REFUSED
            return
        self._current = min(max(current, 0.0), SOURCE_LIMIT_MA)
        self._status = ENABLED | (CLAMPED if self._current != current else 0)
        self._in_force, self._fed = sequence, self._clock()
        if self._written[5]:
            self._sample(self._current)
            self._time_us = self._time_us + period_us & 0xFFFFFFFF

    def _look_at_watchdog(self) -> None:
        limit_ms = self._written[4]
        if self._fed is not None and limit_ms and self._clock() - self._fed > 1e-3 * limit_ms:
            self._status |= TRIPPED
            self._current, self._fed = 0.0, None

    def _sample(self, current: float) -> None:
        """Move the film by one period, and read it with the instruments' noise and steps."""
        bench = self._bench
        resistance, deflection = self._film.advance(current)
        resistance *= 1.0 + bench.resistance_noise * float(self._noise.normal())
        if step := bench.resistance_step_ohm:
            resistance = step * max(round(resistance / step), 1)
        deflection += bench.deflection_noise_um * float(self._noise.normal())
        self._readings = (resistance, deflection)
        self._counter = self._counter + 1 & 0xFFFFFFFF

    def _measured(self) -> list[int]:
        resistance, deflection = self._readings
        frame = struct.pack(
            ">fIHIfH", resistance, self._counter, self._status, self._time_us, deflection, self._in_force or 0
        )
        return list(struct.unpack(">10H", frame))


def _words(value: int) -> list[int]:
    return [value >> 16, value & 0xFFFF]
