"""A simulated device as its wire sees it: enable, sequence, limits, watchdog and clock around a plant.

Device time is counted in whole microseconds. Free-running, it follows the injected clock: the plant is
advanced lazily, at each access, and a watchdog that ran out in between trips at its exact time. In lockstep
only a fresh accepted command lets time pass, one sample period with the new level, then the instruments are
read once and the reading stays until the next. The watchdog counts device time there as well: it can only
trip inside a sample, where the period exceeds it, because between samples no time passes.

Choices where the register map leaves room:
- The lease of a command ends strictly after the watchdog time, so watchdog = period never trips in
  lockstep.
- Enabled, the device stays at the off levels until the first command: 0 on the first channel, which carries
  the power, the safe level on further ones (a frequency of 0 is none). A trip forces the plant's safe levels.
- A refused command changes nothing but bit 4: it is not in force, feeds no watchdog and advances no
  lockstep.
- Re-arming (enable 0, then 1) clears bits 1 and 4 and puts the watchdog to sleep until the next command.
  The last sequence number is kept, so that a replayed frame cannot restart the device.
- Entering lockstep before the first command powers up anew (plant, time, counter): a lockstep run does not
  depend on how long the device has waited for it.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from math import isfinite

from plant_sim.compiled_device import CompiledDevice, CompiledPlant, DeviceMemory
from plant_sim.plant import Plant
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.border.wire.wire_memory import CompiledExchange

_ENABLED = int(DeviceStatus.ENABLED)  # plain ints: an IntFlag operation costs a microsecond
_TRIPPED = int(DeviceStatus.WATCHDOG_TRIPPED)
_CLAMPED = int(DeviceStatus.CLAMPED)
_SENSOR_FAULT = int(DeviceStatus.SENSOR_FAULT)
_REFUSED = int(DeviceStatus.REFUSED)
_UINT32 = 0xFFFFFFFF


class SimulatedDevice:
    """A device (`rtctl.border.records.Device`) around a plant; `clock` [s] is not used in lockstep."""

    def __init__(self, plant: Plant, clock: Callable[[], float] = time.monotonic) -> None:
        self.profile = plant.profile
        self.identity = plant.identity
        self._plant = plant
        self._clock = clock
        self._commands = struct.Struct(f"{len(plant.profile.commands)}f")
        self._readings = struct.Struct(f"{len(plant.profile.sensed) + 1}f")
        self._low = self._float32(plant.low)
        self._high = self._float32(plant.high)
        self.off = (0.0, *self._float32(plant.safe)[1:])
        self._levels: tuple[float, ...] = self.off
        self._status = 0
        self._sequence: int | None = None  # None: no command since power-up
        self._counter = 0
        self._sensed: tuple[float, ...] | None = None  # None: nothing read since the clock was set
        self._reference = float("nan")
        self._lockstep = False
        self._period_us = 1000
        self._period_s = 1e-3
        self._watchdog_us = 0
        self._fed_us: int | None = None  # None: the watchdog sleeps
        self._time_us = 0
        self._epoch_s = clock()

    @property
    def enabled(self) -> bool:
        """Whether the device is enabled, register 3."""
        return bool(self._status & _ENABLED)

    @property
    def watchdog_ms(self) -> int:
        """Watchdog time [ms], register 4; 0: none."""
        return self._watchdog_us // 1000

    @property
    def lockstep(self) -> bool:
        """Whether the device runs in lockstep, register 5."""
        return self._lockstep

    @property
    def period_us(self) -> int:
        """Sample period in lockstep [us], registers 6-7."""
        return self._period_us

    def exchange(self, levels: Sequence[float], sequence: int) -> Measurement:
        """Command, then read. Raises ValueError on a level that is no finite float32."""
        self.command(levels, sequence)
        return self.read()

    def command(self, levels: Sequence[float], sequence: int) -> None:
        """Take a command: commands and register 2 are written.

        Args:
            levels: level of each command, in the profile's units.
            sequence: sequence number (uint16).

        Raises:
            ValueError: a level is not a finite float32.
        """
        asked = self._float32(levels)
        if not self._lockstep:
            self._live_until_now()
        if sequence == self._sequence:
            return
        if self._status & (_ENABLED | _TRIPPED) != _ENABLED:
            self._status |= _REFUSED
            return
        self._levels = levels = self._clamped(asked)
        self._status = _ENABLED | (_CLAMPED if levels != asked else 0) | (self._status & _SENSOR_FAULT)
        self._sequence = sequence
        self._fed_us = self._time_us
        if self._lockstep:
            self._sample()

    def read(self) -> Measurement:
        """Read registers 100-111: free-running, measured now; in lockstep, as the last sample left them."""
        if not self._lockstep:
            self._live_until_now()
            self._measured(*self._plant.measure())
        elif self._sensed is None:
            self._measured(*self._plant.measure())
        return Measurement(
            self._sensed or (),
            self._reference,
            self._counter & _UINT32,
            self._time_us & _UINT32,
            self._sequence or 0,
            self._status,
        )

    def compiled_exchange(self) -> CompiledExchange | None:
        """Return `exchange` for a compiled loop; None if the plant has none, or this device is a derived one."""
        find = getattr(self._plant, "compiled_plant", None)
        if find is None or type(self) is not SimulatedDevice or self._clock is not time.monotonic:
            return None
        plant: CompiledPlant | None = find()
        return None if plant is None else CompiledDevice(self, plant).exchange()

    def memory(self) -> DeviceMemory:
        """Return the state, for a compiled block of exchanges."""
        return DeviceMemory(
            self._levels[0], self._low[0], self._high[0], self._epoch_s, self._status, self._sequence,
            self._counter, self._time_us, self._fed_us, self._watchdog_us, self._lockstep, self._period_us,
            self._sensed, self._reference,
        )  # fmt: skip

    def resume(self, memory: DeviceMemory) -> None:
        """Go on from there."""
        self._levels, self._status, self._sequence = (memory.level,), memory.status, memory.sequence
        self._counter, self._time_us, self._fed_us = memory.counter, memory.time_us, memory.fed_us
        self._sensed, self._reference = memory.sensed, memory.reference

    def set_enable(self, on: bool) -> None:
        """Set register 3; off: the off level; off, then on: clears the watchdog's trip and a refusal."""
        if not self._lockstep:
            self._live_until_now()
        if not on:
            self._status &= ~(_ENABLED | _CLAMPED)
            self._levels = self.off
            self._fed_us = None
        elif not self._status & _ENABLED:
            self._status = _ENABLED | (self._status & _SENSOR_FAULT)

    def set_watchdog(self, period_ms: int) -> None:
        """Set the watchdog [ms], register 4, 0: none; it counts from the last accepted command. Raises ValueError."""
        if not 0 <= period_ms <= 0xFFFF:
            raise ValueError(f"watchdog must be 0 (none) to 65535 ms, got {period_ms!r}")
        if not self._lockstep:
            self._live_until_now()
        self._watchdog_us = 1000 * period_ms

    def set_clock(self, *, lockstep: bool, period_us: int) -> None:
        """Set registers 5 and 6-7; device time goes on from where it is. Raises ValueError."""
        if not 0 < period_us <= _UINT32 and (lockstep or period_us != 0):
            raise ValueError(f"sample period must be 1 to {_UINT32} us, got {period_us!r}")
        if not self._lockstep:
            self._live_until_now()
        if lockstep != self._lockstep:
            if lockstep and self._sequence is None:
                self._power_up()
            self._epoch_s = self._clock() - 1e-6 * self._time_us
            self._sensed = None
        self._lockstep = lockstep
        if period_us:  # free-running callers may leave the period out
            self._period_us = period_us
            self._period_s = 1e-6 * period_us

    def power_cycle(self) -> None:
        """Restart as after a blown fuse: off, settings and numbers forgotten; the plant is as warm as it was."""
        if not self._lockstep:
            self._live_until_now()
        self._levels, self._status, self._sequence, self._fed_us = self.off, 0, None, None
        self._lockstep, self._watchdog_us, self._sensed = False, 0, None
        self._counter = self._time_us = 0
        self._epoch_s = self._clock()

    def _power_up(self) -> None:
        """Forget the machine's time since power-up, and the noise that it drew."""
        self._plant.reset()
        self._counter = self._time_us = 0

    def _float32(self, levels: Sequence[float]) -> tuple[float, ...]:
        """Return `levels` rounded to float32. Raises ValueError on what no register pair can carry."""
        try:
            rounded: tuple[float, ...] = self._commands.unpack(self._commands.pack(*levels))
        except (struct.error, OverflowError) as error:
            raise ValueError(f"command {tuple(levels)!r}: {error}") from None
        for level in rounded:
            if not isfinite(level):
                raise ValueError(f"command {tuple(levels)!r}: a finite level is needed")
        return rounded

    def _clamped(self, asked: tuple[float, ...]) -> tuple[float, ...]:
        """Return `asked` within the plant's limits."""
        for level, low, high in zip(asked, self._low, self._high, strict=True):
            if not low <= level <= high:
                return tuple(map(min, map(max, asked, self._low), self._high))
        return asked

    def _sample(self) -> None:
        """Advance by one lockstep sample; the lease of its command may end inside it."""
        if 0 < self._watchdog_us < self._period_us:
            self._live_until(self._time_us + self._period_us)
            self._measured(*self._plant.measure())
        else:
            self._time_us += self._period_us
            self._measured(*self._plant.step(self._levels, self._period_s))

    def _measured(self, sensed: Sequence[float], reference: float) -> None:
        rounded = self._readings.unpack(self._readings.pack(*sensed, reference))
        self._sensed, self._reference = rounded[:-1], rounded[-1]
        self._counter += 1
        self._status &= ~_SENSOR_FAULT
        for reading in self._sensed:
            if not isfinite(reading):
                self._status |= _SENSOR_FAULT

    def _live_until_now(self) -> None:
        self._live_until(round((self._clock() - self._epoch_s) * 1e6))

    def _live_until(self, time_us: int) -> None:
        """Advance the plant to device time `time_us` [us], through the watchdog's trip if it lies before."""
        if self._fed_us is not None and self._watchdog_us:
            due_us = self._fed_us + self._watchdog_us
            if time_us > due_us:
                self._hold_until(due_us)
                self._levels = tuple(self._plant.safe)
                self._status = (self._status & ~_CLAMPED) | _TRIPPED
                self._fed_us = None
        self._hold_until(time_us)

    def _hold_until(self, time_us: int) -> None:
        if time_us > self._time_us:
            self._plant.advance(self._levels, 1e-6 * (time_us - self._time_us))
            self._time_us = time_us
