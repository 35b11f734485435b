"""A journal of what a device did: the levels that reached the plant, commands that came into force, readings.

The account of the applied levels is kept at the plant, below everything that could be wrong about commands. Rows are
`event, time_us, number, values`: time since power-up [us], going on through restarts; values in the profile's units.

| event | number | values |
|---|---|---|
| applied | how long [us] | levels at the plant |
| command | sequence number | levels after the device's own limits |
| reading | sample counter | sensed values |
| off | status | – |
| restart | – | – |
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from plant_sim.device import SimulatedDevice
from plant_sim.plant import Plant


class Entry(NamedTuple):
    """A row of the journal."""

    event: str
    time_us: int
    number: int
    values: tuple[float, ...]


class JournalledPlant:
    """A plant that notes what it is given; equal levels in a row are one entry."""

    def __init__(self, plant: Plant) -> None:
        self.profile, self.identity = plant.profile, plant.identity
        self.low, self.high, self.safe = plant.low, plant.high, plant.safe
        self.entries: list[Entry] = []
        self.now_us = 0
        self._plant = plant
        self._last: Entry | None = None

    def reset(self) -> None:
        """See `Plant`."""
        self._plant.reset()

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """See `Plant`."""
        self._note(tuple(levels), dt_s)
        self._plant.advance(levels, dt_s)

    def measure(self) -> tuple[tuple[float, ...], float]:
        """See `Plant`."""
        return self._plant.measure()

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """See `Plant`."""
        self._note(tuple(levels), dt_s)
        return self._plant.step(levels, dt_s)

    def applied(self) -> list[Entry]:
        """Return all levels so far."""
        return [*self.entries, *([self._last] if self._last else [])]

    def _note(self, levels: tuple[float, ...], dt_s: float) -> None:
        duration_us = round(1e6 * dt_s)
        if self._last is not None and self._last.values == levels:
            self._last = self._last._replace(number=self._last.number + duration_us)
        else:
            if self._last is not None:
                self.entries.append(self._last)
            self._last = Entry("applied", self.now_us, duration_us, levels)
        self.now_us += duration_us


class JournalledDevice(SimulatedDevice):
    """A `SimulatedDevice` that keeps a journal of itself."""

    def __init__(self, plant: Plant, clock: Callable[[], float] = time.monotonic) -> None:
        self._journalled = JournalledPlant(plant)
        self._entries: list[Entry] = []
        super().__init__(self._journalled, clock)

    def command(self, levels: Sequence[float], sequence: int) -> None:
        """See `SimulatedDevice`."""
        before, begun_us = self._sequence, self._journalled.now_us
        super().command(levels, sequence)
        if self._sequence != before:
            at_us = begun_us if self.lockstep else self._journalled.now_us
            self._entries.append(Entry("command", at_us, sequence, tuple(self._levels)))

    def set_enable(self, on: bool) -> None:
        """See `SimulatedDevice`."""
        super().set_enable(on)
        if not on:
            self._note("off", self._status)

    def power_cycle(self) -> None:
        """See `SimulatedDevice`."""
        super().power_cycle()
        self._note("restart", 0)

    def journal(self) -> list[Entry]:
        """Return all entries so far, by time."""
        return sorted([*self._journalled.applied(), *self._entries], key=lambda entry: entry.time_us)

    def write_journal(self, path: Path) -> None:
        """Write the journal as CSV; the values in one column, with spaces between."""
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(Entry._fields)
            for entry in self.journal():
                values = " ".join(map(repr, entry.values))
                writer.writerow([entry.event, entry.time_us, entry.number, values])

    def _measured(self, sensed: Sequence[float], reference: float) -> None:
        super()._measured(sensed, reference)
        assert self._sensed is not None
        self._note("reading", self._counter, self._sensed)

    def _note(self, event: str, number: int, values: tuple[float, ...] = ()) -> None:
        self._entries.append(Entry(event, self._journalled.now_us, number, values))


def is_journal(path: Path) -> bool:
    """Return whether the file at `path` is a journal, or empty."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.readline().strip() in (b"", ",".join(Entry._fields).encode())


def read_journal(path: Path) -> list[Entry]:
    """Return the entries of a journal file."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Entry(event, int(time_us), int(number), tuple(map(float, values.split())))
            for event, time_us, number, values in list(csv.reader(file))[1:]
        ]
