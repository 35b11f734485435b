"""A device on a test bench: faults of its own on purpose, and an account of what it really does.

A row of the account is written at each reading, and between readings while time passes by itself: commands in force,
what the plant really does (`plant_sim.inspection`), readings as the host gets them.
"""

from __future__ import annotations

import heapq
import itertools
import time
from collections.abc import Callable, Sequence
from enum import StrEnum
from math import nan

from plant_sim.device import SimulatedDevice
from plant_sim.inspection import Inspection, NoInspection, inspection_of
from plant_sim.journal import JournalledDevice
from plant_sim.plant import Plant
from rtctl.border.records import DeviceStatus, Measurement

INDEX_US = 100
"""Time of one step of the account's index [us]: readings that follow each other faster share a row."""


class DeviceFault(StrEnum):
    """A fault of a device, by the name under which `rtctl run` reports it (`rtctl.border.errors.Fault`)."""

    FROZEN_VALUE = "frozen_value"  # the readings stay as they are
    SENSOR_FAULT = "sensor_fault"  # no reading: NaN, and its status bit
    FROZEN_COUNTER = "frozen_counter"  # the sample counter stays as it is
    WATCHDOG_TRIPPED = "watchdog_tripped"  # the device takes its safe levels and refuses commands
    NOT_ENABLED = "not_enabled"  # somebody has switched the device off


LASTING = (DeviceFault.FROZEN_VALUE, DeviceFault.SENSOR_FAULT, DeviceFault.FROZEN_COUNTER)
"""Faults that end by themselves."""


class BenchDevice(SimulatedDevice):
    """A `SimulatedDevice` with faults and an account; times of faults are those of the device."""

    def __init__(
        self, plant: Plant, clock: Callable[[], float] = time.monotonic, *, is_inspected: bool = True
    ) -> None:
        """Make the device; without an inspection its plant computes as it does without a bench, to the bit."""
        self.inspection: Inspection = inspection_of(plant) if is_inspected else NoInspection()
        super().__init__(plant, clock)
        self.account: Callable[[tuple[float, ...]], object] = lambda row: None
        """Takes the rows; see `columns`."""
        self.line_faults: Callable[[], int] = lambda: 0
        """Returns how many faults the line has had."""
        profile = self.profile
        self.columns: list[tuple[str, str]] = [
            ("index", ""),
            *((one.name, one.unit) for one in profile.commands),
            *self.inspection.truths,
            *((one.name, one.unit) for one in (*profile.sensed, profile.reference)),
            ("line_faults", "count"),
            ("device_status", ""),
        ]
        self._now_us = self._seen_us = 0
        self._first_us: int | None = None
        self._index = -1
        self._until_us: dict[DeviceFault, int] = {}
        self._held: Measurement | None = None
        self._last = (nan,) * (len(self.profile.sensed) + 1)
        self._planned: list[tuple[int, int, Callable[[], object]]] = []
        self._count = itertools.count()

    @property
    def index(self) -> int:
        """Time of the account now [`INDEX_US`]; it goes on when the device restarts."""
        return self._now_us // INDEX_US

    def plan(self, after_s: float, act: Callable[[], object]) -> None:
        """Call `act` so long after the first command [s]."""
        heapq.heappush(self._planned, (round(1e6 * after_s), next(self._count), act))

    def strike(self, fault: DeviceFault, duration_s: float) -> None:
        """Begin a fault now; one that lasts ends after `duration_s` [s]."""
        if fault is DeviceFault.NOT_ENABLED:
            self.set_enable(False)
        elif fault is DeviceFault.WATCHDOG_TRIPPED:
            self.trip()
        else:
            self._until_us[fault] = self._now_us + round(1e6 * duration_s)

    def trip(self) -> None:
        """Take the safe levels as if the watchdog had run out."""
        if not self.lockstep:
            self._live_until_now()
        self._levels = tuple(self._plant.safe)
        self._status = (self._status & ~int(DeviceStatus.CLAMPED)) | int(DeviceStatus.WATCHDOG_TRIPPED)
        self._fed_us = None

    def command(self, levels: Sequence[float], sequence: int) -> None:
        """See `SimulatedDevice`."""
        before = self._sequence
        super().command(levels, sequence)
        if self._first_us is None and self._sequence != before:
            self._pass_time()
            self._first_us = self._now_us

    def read(self) -> Measurement:
        """See `SimulatedDevice`; with the faults that are there."""
        sound = super().read()
        self._pass_time()
        found = self._with_faults(sound)
        self._last = (*found.sensed, found.reference)
        self._account()
        return found

    def live(self) -> None:
        """Let time pass that passes by itself, and note what the plant does."""
        if not self.lockstep:
            self._live_until_now()
        self._pass_time()
        self._account()

    def power_cycle(self) -> None:
        """See `SimulatedDevice`."""
        if not self.lockstep:
            self._live_until_now()
        self._pass_time()
        self._seen_us = 0
        super().power_cycle()

    def _power_up(self) -> None:
        self._pass_time()
        self._seen_us = 0
        super()._power_up()

    def _pass_time(self) -> None:
        """Follow the device's time; begin what was planned for by now."""
        self._now_us += self._time_us - self._seen_us
        self._seen_us = self._time_us
        while (
            self._planned
            and self._first_us is not None
            and self._planned[0][0] <= self._now_us - self._first_us
        ):
            heapq.heappop(self._planned)[2]()

    def _with_faults(self, sound: Measurement) -> Measurement:
        acting = [fault for fault in LASTING if self._until_us.get(fault, -1) > self._now_us]
        if not acting:
            self._held = None
            return sound
        held = self._held = self._held or sound
        found = sound
        if DeviceFault.FROZEN_VALUE in acting:
            found = found._replace(sensed=held.sensed)
        if DeviceFault.FROZEN_COUNTER in acting:
            found = found._replace(counter=held.counter)
        if DeviceFault.SENSOR_FAULT in acting:
            status = found.status | int(DeviceStatus.SENSOR_FAULT)
            found = found._replace(sensed=(nan,) * len(found.sensed), status=status)
        return found

    def _account(self) -> None:
        if self.index > self._index:
            self._index = self.index
            self.account((
                float(self._index), *self._levels, *self.inspection.truth(), *self._last,
                float(self.line_faults()), float(self._status),
            ))  # fmt: skip


class JournalledBenchDevice(BenchDevice, JournalledDevice):
    """A `BenchDevice` that keeps a journal, too."""
