"""A device on a test bench, under way: faults as they were planned or are asked for, effects as they are switched.

What can be changed has a name: numbers of the plant (`effects.delay`), and `fault.KIND`, whose value is how long the
fault lasts [s]: it strikes at once, and once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from plant_sim.bench.device import INDEX_US, LASTING, BenchDevice, DeviceFault
from plant_sim.bench.line import Line
from rtctl.border.errors import InputError, nearest

FAULT = "fault."
STOP = "stop"
USUAL_S = 0.1
"""Duration of a fault that nobody has given another one [s]."""
LONGEST_S = 60.0
CHANCE_EVERY_S = 10.0
"""How often faults that strike a share of the bursts are told, after the first one of their kind [s]."""
INSTANT = frozenset(
    {"drop", "duplicate", "bit_flip", "truncate", "device_reboot", "watchdog_tripped", "not_enabled"}
)
"""Faults that take no time."""
OF_DEVICE = frozenset(map(str, DeviceFault))


class PlannedFault(NamedTuple):
    """A fault for a time."""

    after_s: float
    """Time after the first command [s]."""
    kind: str
    duration_s: float


class Bench:
    """The device, the line before it, and everybody who wants to know what happens."""

    def __init__(self, device: BenchDevice, line: Line, planned: Sequence[PlannedFault] = ()) -> None:
        self.device, self.line = device, line
        self.note: Callable[[int, str, str, float], object] = lambda index, kind, name, value: None
        """Is told index, "change", "fault" or "chance", name and value of what was done; of "chance" the value is how
        many bursts of bytes were struck."""
        self.changes: Callable[[], Iterable[tuple[str, float]]] = tuple
        """Returns the changes that are wanted by now."""
        self._told: dict[str, int] = {}
        self._told_index: dict[str, int] = {}
        device.line_faults = lambda: line.injected
        for one in planned:
            device.plan(one.after_s, lambda one=one: self.apply(FAULT + one.kind, one.duration_s))  # type: ignore[misc]

    period_s = 1e-6 * INDEX_US
    """Time of one step of the account's index [s]."""

    @property
    def units(self) -> dict[str, str]:
        """Units of what can be changed, by name."""
        faults = {FAULT + kind: "s" for kind in (*DeviceFault, *self.line.kinds)}
        return {**self.device.inspection.switches, **faults}

    def values(self) -> dict[str, float]:
        """Return the numbers of the plant, and usual durations of faults."""
        usual = {name: 0.0 if name.removeprefix(FAULT) in INSTANT else USUAL_S for name in self.units}
        return {**usual, **self.device.inspection.values()}

    def check(self, name: str, value: float) -> str:
        """Return what to know of a change, "" where nothing, after all that is slow about it.

        Raises:
            InputError: there is no such name, or it cannot have this value.
        """
        if name not in self.units:
            raise InputError(f'"{name}" cannot be changed{nearest(name, self.units)}')
        if not name.startswith(FAULT):
            self.device.inspection.check(name, value)
            return ""
        if not 0.0 <= value <= LONGEST_S:
            raise InputError(f"{name} = {value:g} s: a fault lasts 0 to {LONGEST_S:g} s")
        kind = name.removeprefix(FAULT)
        if value == 0.0 and kind not in INSTANT:
            raise InputError(f"{name} = 0 s: this fault needs a duration, such as 100 ms")
        return "" if kind in OF_DEVICE else "it strikes the next bytes on the line"

    def apply(self, name: str, value: float) -> None:
        """Make a change that was checked."""
        device, kind = self.device, name.removeprefix(FAULT)
        if name == STOP:
            device.trip()
        elif name == kind:
            device.inspection.switch(name, value)
        elif kind in OF_DEVICE:
            device.strike(DeviceFault(kind), value)
        else:
            self.line.ask(kind, value)
        self.note(device.index, "change" if name == kind and name != STOP else "fault", kind, value)

    def look(self) -> None:
        """Make the changes that are wanted, and let time pass."""
        for name, value in self.changes():
            self.apply(name, value)
        self.device.live()
        self.tell_of_chance(CHANCE_EVERY_S)

    def tell_of_chance(self, every_s: float) -> None:
        """Note what has struck a share of the bursts: the first of a kind at once, further ones together.

        Args:
            every_s: time of the device between two notes of a kind [s]; 0: whatever is new.
        """
        index = self.device.index
        for kind, count in self.line.struck_by_chance().items():
            told = self._told.get(kind, 0)
            is_due = not told or (index - self._told_index[kind]) * self.period_s >= every_s
            if count > told and is_due:
                self.note(index, "chance", kind, float(count - told))
                self._told[kind], self._told_index[kind] = count, index


assert all(fault in LASTING or fault in INSTANT for fault in DeviceFault)
