"""An instrument that takes SCPI messages: a table of headers, an error queue, common commands."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from plant_sim.wire.scpi.grammar import Unit, header_pattern, plain, units_of
from plant_sim.wire.scpi.source_meter import (
    LARGEST_CURRENT_A,
    LARGEST_VOLTAGE_V,
    RefusedError,
    SourceMeter,
    in_range,
)

QUEUE_LENGTH = 10
COMMAND_ERRORS = range(-199, -99)
Write = Callable[[tuple[str, ...]], None]
Read = Callable[[tuple[str, ...]], str]


class Entry(NamedTuple):
    """A command of an instrument."""

    header: str
    """As the manual writes it."""
    write: Write | None = None
    read: Read | None = None
    aperture_s: Callable[[], float] | None = None
    """How long `read` takes, where that is a measurement."""


class ScpiInstrument:
    """Bytes aside: a message in, an answer out. What it does not know, or refuses, goes into the error queue."""

    def __init__(self, identity: str, entries: Sequence[Entry], reset: Callable[[], None]) -> None:
        """Make an instrument from its identity, its commands beside the common ones, and what `*RST` does."""
        self.identity = identity
        self._errors: deque[tuple[int, str]] = deque(maxlen=QUEUE_LENGTH)
        self._entries = [*self._common(reset), *entries]

    async def answer(self, message: str) -> str:
        """Carry out a message; return the answers to its questions, "" if it has none."""
        answers = []
        for unit in units_of(message):
            try:
                answers += await self._carried_out(unit)
            except RefusedError as error:
                self._errors.append((error.code, error.text))
                if error.code in COMMAND_ERRORS:
                    break  # what follows is not understood either
        return ";".join(answers)

    async def _carried_out(self, unit: Unit) -> list[str]:
        """Return the answer of a unit, if it has one. Raises RefusedError."""
        entry = self._entry(unit)
        if entry.aperture_s is not None:
            await asyncio.sleep(entry.aperture_s())
        if unit.is_query and entry.read is not None:
            return [entry.read(unit.parameters)]
        if entry.write is not None:
            entry.write(unit.parameters)
        return []

    def _entry(self, unit: Unit) -> Entry:
        for entry in self._entries:
            known = entry.read if unit.is_query else entry.write
            if known is not None and header_pattern(entry.header).fullmatch(unit.header):
                return entry
        raise RefusedError(-113, "Undefined header")

    def _common(self, reset: Callable[[], None]) -> list[Entry]:
        def next_error(_: tuple[str, ...]) -> str:
            code, text = self._errors.popleft() if self._errors else (0, "No error")
            return f'{code:+d},"{text}"'

        return [
            Entry("*IDN", read=lambda _: self.identity),
            Entry("*RST", write=lambda _: reset()),
            Entry("*CLS", write=lambda _: self._errors.clear()),
            Entry("*OPC", write=lambda _: None, read=lambda _: "1"),
            Entry(":SYSTem:ERRor[:NEXT]", read=next_error),
        ]


def number_of(parameters: tuple[str, ...]) -> float:
    """Return the one number among the parameters. Raises RefusedError."""
    if len(parameters) != 1:
        raise (
            RefusedError(-109, "Missing parameter")
            if not parameters
            else RefusedError(-108, "Parameter not allowed")
        )
    try:
        return float(parameters[0])
    except ValueError:
        raise RefusedError(-104, "Data type error") from None


def switch_of(parameters: tuple[str, ...]) -> bool:
    """Return a boolean parameter. Raises RefusedError."""
    known = {"1": True, "ON": True, "0": False, "OFF": False}
    if len(parameters) != 1 or plain(parameters[0]) not in known:
        raise RefusedError(-104, "Data type error")
    return known[plain(parameters[0])]


SWITCH = ("0", "1", "ON", "OFF")


def fixed(header: str, told: str, allowed: Sequence[str] = SWITCH) -> Entry:
    """Return a setting without effect here: it takes one of the words `allowed`, and tells `told`."""

    def write(parameters: tuple[str, ...]) -> None:
        if ",".join(plain(parameter) for parameter in parameters) not in allowed:
            raise RefusedError(
                -221, "Settings conflict; simulated instruments source a current and read a voltage"
            )

    return Entry(header, write=write, read=lambda _: told)


def source_entries(meter: SourceMeter, headers: dict[str, str]) -> list[Entry]:
    """Return the commands that every source meter has, by the headers that it has for them.

    Args:
        meter: what they act on.
        headers: header of `level`, `current_range`, `compliance`, `voltage_range`, `nplc`, `output`.
    """

    def setting(name: str, attribute: str, low: float, high: float) -> Entry:
        def write(parameters: tuple[str, ...]) -> None:
            setattr(meter.settings, attribute, in_range(low, number_of(parameters), high))

        return Entry(headers[name], write=write, read=lambda _: _told(getattr(meter.settings, attribute)))

    def automatic(name: str, attribute: str, manual: float) -> Entry:
        def write(parameters: tuple[str, ...]) -> None:
            setattr(meter.settings, attribute, None if switch_of(parameters) else manual)

        return Entry(
            f"{headers[name]}:AUTO",
            write=write,
            read=lambda _: str(int(getattr(meter.settings, attribute) is None)),
        )

    return [
        setting("current_range", "current_range_A", 0.0, LARGEST_CURRENT_A),
        automatic("current_range", "current_range_A", LARGEST_CURRENT_A),
        setting("voltage_range", "voltage_range_V", 0.0, LARGEST_VOLTAGE_V),
        automatic("voltage_range", "voltage_range_V", LARGEST_VOLTAGE_V),
        setting("compliance", "compliance_V", 1e-6, LARGEST_VOLTAGE_V),
        setting("nplc", "nplc", 1e-4, 100.0),
        Entry(
            headers["level"],
            write=lambda parameters: meter.set_level(number_of(parameters)),
            read=lambda _: _told(meter.settings.level_A),
        ),
        Entry(
            headers["output"],
            write=lambda parameters: meter.switch(switch_of(parameters)),
            read=lambda _: str(int(meter.is_on)),
        ),
    ]


def _told(value: float | None) -> str:
    return f"{0.0 if value is None else value:+.6E}"
