"""Channel A of a Keithley 2600B (manual 2600BS-901-01, section 7): the part of TSP that sources a current and reads.

A line is a chunk of Lua. Understood are assignments of numbers and constants, calls without results, and `print`.
"""

from __future__ import annotations

import asyncio
import re
from collections import deque
from collections.abc import Callable
from functools import partial

from plant_sim.wire.scpi.instrument import QUEUE_LENGTH
from plant_sim.wire.scpi.source_meter import (
    LARGEST_CURRENT_A,
    LARGEST_VOLTAGE_V,
    RefusedError,
    SourceMeter,
    in_range,
)

_NAME = r"[A-Za-z_]\w*(?:\.\w+)*"
_STATEMENT = re.compile(
    rf"\s*(?:(?P<set>{_NAME})\s*=\s*(?P<value>[-+\w.]+)|(?P<call>{_NAME})\((?P<arguments>[^()]*(?:\([^()]*\)[^()]*)*)\))\s*;?"
)
_RUNTIME = (-286, "TSP Runtime error")
_SYNTAX = (-285, "TSP Syntax error")
CONSTANTS = {
    "smua.OUTPUT_DCAMPS": 0.0, "smua.OUTPUT_DCVOLTS": 1.0, "smua.OUTPUT_ON": 1.0, "smua.OUTPUT_OFF": 0.0,
    "smua.AUTORANGE_OFF": 0.0, "smua.AUTORANGE_ON": 1.0, "true": 1.0, "false": 0.0,
}  # fmt: skip
MEASURED = ("smua.measure.v()", "smua.measure.i()", "smua.measure.r()")
CONDITION = "status.measurement.instrument.smua.condition"


class TspInstrument:
    """A line in, an answer out; errors go into the error queue."""

    def __init__(self, meter: SourceMeter, identity: str) -> None:
        """Take the source meter that it is the front of."""
        self.identity = identity
        self._meter = meter
        self._errors: deque[tuple[int, str]] = deque(maxlen=QUEUE_LENGTH)
        self._precision = 6
        self._limited = False
        settings: dict[str, tuple[str, float, float]] = {
            "smua.source.limitv": ("compliance_V", 1e-6, LARGEST_VOLTAGE_V),
            "smua.source.rangei": ("current_range_A", 0.0, LARGEST_CURRENT_A),
            "smua.measure.rangev": ("voltage_range_V", 0.0, LARGEST_VOLTAGE_V),
            "smua.measure.nplc": ("nplc", 1e-3, 25.0),
        }
        self._write: dict[str, Callable[[float], None]] = {
            name: partial(self._set, *bounds) for name, bounds in settings.items()
        }
        self._write |= {
            "smua.source.leveli": meter.set_level,
            "smua.source.func": self._only_current,
            "smua.source.output": lambda value: meter.switch(value != 0.0),
            "format.asciiprecision": self._set_precision,
        }
        self._read: dict[str, Callable[[], float | str]] = {
            name: partial(self._told, bounds[0]) for name, bounds in settings.items()
        }
        self._read |= {
            "smua.source.leveli": lambda: meter.settings.level_A,
            "smua.source.func": lambda: 0.0,
            "smua.source.output": lambda: float(meter.is_on),
            "localnode.model": lambda: "2602B",
            "localnode.linefreq": lambda: 50.0,
            CONDITION: lambda: float(self._limited),  # bit 0: the voltage is at its limit
        }

    async def answer(self, message: str) -> str:
        """Carry out a line; return what it prints, "" if nothing."""
        if message.strip().upper() == "*IDN?":
            return self.identity
        printed, at = [], 0
        try:
            while message[at:].strip():
                found = _STATEMENT.match(message, at)
                if found is None:
                    raise RefusedError(*_SYNTAX)
                at = found.end()
                if found["call"] == "print":
                    printed.append("\t".join([await self._value(a) for a in _arguments(found["arguments"])]))
                elif found["call"] is not None:
                    self._call(found["call"])
                else:
                    self._assign(found["set"], found["value"])
        except RefusedError as error:
            self._errors.append((error.code, error.text))
        return "\n".join(printed)

    def _assign(self, name: str, text: str) -> None:
        if name not in self._write:
            raise RefusedError(_RUNTIME[0], f"{_RUNTIME[1]}: {name} cannot be set here")
        try:
            self._write[name](CONSTANTS[text] if text in CONSTANTS else float(text))
        except ValueError:
            raise RefusedError(*_SYNTAX) from None

    def _call(self, name: str) -> None:
        if name in ("smua.reset", "reset"):
            self._meter.reset()
        elif name == "errorqueue.clear":
            self._errors.clear()
        else:
            raise RefusedError(_RUNTIME[0], f"{_RUNTIME[1]}: {name} cannot be called here")

    async def _value(self, expression: str) -> str:
        """Return what `print` makes of an expression."""
        if expression == "errorqueue.next()":
            code, text = self._errors.popleft() if self._errors else (0, "Queue Is Empty")
            return "\t".join([f"{code:.5e}", text, "0.00000e+00", "0.00000e+00"])
        if expression in MEASURED:
            await asyncio.sleep(self._meter.aperture_s)
            m = self._meter.measure()
            self._limited = m.limited
            values = (m.voltage_V, m.current_A, m.voltage_V / m.current_A if m.current_A else float("nan"))
            return self._formatted(values[MEASURED.index(expression)])
        if expression not in self._read:
            return "nil"
        value = self._read[expression]()
        return value if isinstance(value, str) else self._formatted(value)

    def _formatted(self, value: float) -> str:
        return f"{value:.{self._precision - 1}e}"

    def _set(self, attribute: str, low: float, high: float, value: float) -> None:
        setattr(self._meter.settings, attribute, in_range(low, value, high))

    def _told(self, attribute: str) -> float:
        return float(getattr(self._meter.settings, attribute) or 0.0)

    def _set_precision(self, value: float) -> None:
        self._precision = int(in_range(1, value, 16))

    def _only_current(self, value: float) -> None:
        if value != CONSTANTS["smua.OUTPUT_DCAMPS"]:
            raise RefusedError(_RUNTIME[0], f"{_RUNTIME[1]}: this simulated instrument sources a current")


def _arguments(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]
