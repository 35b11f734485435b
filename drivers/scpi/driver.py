"""Driver of a source meter as a device of one command, a current, and of readings: resistance, voltage or current.

An exchange is one message, the question for a reading and then the new level, and its answer:

    :READ?;:SOUR:CURR 0.005   ->
                              <-  +1.234567E+00,+4.900000E-03,+3.481600E+04

In this order a reading is from before its own command, as everywhere in a live loop, however long it takes. The
instrument tells no time, so sample counter and time are the host's. The watchdog is a process beside the program
(`drivers.scpi.lease`) where the line is a socket or a serial port.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence

from drivers.scpi.answers import Reading
from drivers.scpi.instrument import Instrument, filled
from drivers.scpi.lease import Lease
from drivers.scpi.settings import ReferenceMeter, SourceSettings, refuse_misfits, setup_commands
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceProfile, DeviceStatus, Measurement, SwitchedOff
from rtctl.border.units.quantities import convert

_ENABLED = int(DeviceStatus.ENABLED)
_UINT32 = 0xFFFFFFFF
UNITS = {"resistance": "ohm", "voltage": "V", "current": "A"}
"""What is read, and in which unit an instrument tells it."""


class ScpiDriver:
    """A driver (`rtctl.border.records.Driver`) of one source meter, and of an external instrument beside it."""

    def __init__(
        self,
        source: Instrument,
        settings: SourceSettings,
        profile: DeviceProfile,
        reference: ReferenceMeter | None = None,
    ) -> None:
        """Make a driver that is closed. Raises InputError where instrument, settings and device do not fit."""
        refuse_misfits(source, settings)
        if len(profile.commands) != 1:
            raise InputError(
                f"{source.name}: sources one current, a {profile.kind} takes {len(profile.commands)} commands"
            )
        self.profile = profile
        self.identity = ""
        self._source, self._settings, self._reference = source, settings, reference
        self._name = source.name
        self._amperes = _factor(profile.commands[0].unit, "A", f"{self._name}: sources a current")
        self._convert = tuple(_reader(channel.unit, source, settings) for channel in profile.sensed)
        self._commands = source.table.source_commands()
        self._setup = setup_commands(source, settings)
        self._lease: Lease | None = None
        self._is_on = False
        self._in_force_A = settings.safe_A
        self._counter = self._sequence = 0

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Connect, set up with the output off, switch on at the safe level, read once.

        May be called again after a fault: reconnects. Raises DriverError; then the output is off.

        Args:
            lockstep_period_us: must be None: an instrument does not wait for its host.
            watchdog_ms: how long after the last command the output is switched off [ms]; 0: when the program ends.
            timeout_s: time of one answer [s].
        """
        if lockstep_period_us is not None:
            raise InputError(f"{self._name}: an instrument goes on by itself: --set clock.mode=live")
        self._end(self._settings.safe_A)
        self._in_force_A = self._settings.safe_A
        try:
            self._source.open(self._setup, timeout_s)
            if self._reference is not None:
                self._reference.meter.open(self._reference.setup, timeout_s)
            self.identity = self._source.identity
            self._switch_on(watchdog_ms)
            return self._exchange(self._settings.safe_A)
        except BaseException:  # also a second Ctrl-C
            self._end(self._settings.safe_A)
            raise

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Command a current (profile's unit) and read. Raises DriverError."""
        amperes = levels[0] * self._amperes
        settings, unit = self._settings, self.profile.commands[0].unit
        slack = 1e-9 * settings.range_A  # the conversion of units rounds
        if not settings.low_A - slack <= amperes <= settings.high_A + slack:  # also NaN
            raise DriverError(
                Fault.LEVEL_LIMIT,
                f"{self._name}: {levels[0]:.6g} {unit} was not sent: it is outside of [limits], {settings.low_A:g} to "
                f"{settings.high_A:g} A",
            )
        self._renew_lease()
        return self._exchange(amperes)

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff:
        """Command `safe_levels`, switch the output off, disconnect. Never raises."""
        return SwitchedOff.OFF if self._end(safe_levels[0] * self._amperes) else SwitchedOff.SILENT

    def _switch_on(self, watchdog_ms: int) -> None:
        descriptor = self._source.descriptor
        if descriptor is not None:
            off = f"{self._commands.output_off}\n".encode("ascii")
            self._lease = Lease(descriptor, off, 1e-3 * watchdog_ms)
        self._is_on = True  # whatever the answer is
        self._source.command(self._commands.output_on)

    def _renew_lease(self) -> None:
        """Hold the lease anew; it sleeps until the first command, as a device's watchdog does. Raises DriverError."""
        if self._lease is not None and not self._lease.renew():
            raise DriverError(
                Fault.WATCHDOG_TRIPPED,
                f"{self._name}: there was no command for longer than clock.watchdog, so the output was switched off",
            )

    def _exchange(self, amperes: float) -> Measurement:
        level = filled(self._commands.current, amperes)
        self._source.send(f"{self._commands.read}{self._commands.separator}{level}")
        if self._reference is not None:
            self._reference.meter.send(self._reference.meter.table.commands.read)
        in_force_A, self._in_force_A = self._in_force_A, amperes
        reading = self._source.reading()
        self._refuse_other_current(reading, in_force_A)
        sensed = tuple(value(reading, in_force_A) for value in self._convert)
        self._counter = (self._counter + 1) & _UINT32
        self._sequence = (self._sequence + 1) & 0xFFFF
        time_us = time.monotonic_ns() // 1000 & _UINT32
        return Measurement(sensed, self._external(), self._counter, time_us, self._sequence, _ENABLED)

    def _external(self) -> float:
        """Return what the external instrument reads; NaN where there is none."""
        if self._reference is None:
            return math.nan
        volts = self._reference.meter.reading().voltage_V
        if volts is None:
            raise DriverError(Fault.SENSOR_FAULT, f"{self._reference.meter.name}: read no voltage")
        return volts * self._reference.per_volt + self._reference.offset

    def _refuse_other_current(self, reading: Reading, amperes: float) -> None:
        """Raise DriverError where another current flows than the one that was commanded."""
        settings, unit = self._settings, self.profile.commands[0].unit
        level = f"{amperes / self._amperes:.6g} {unit}"
        if reading.limited:
            raise DriverError(
                Fault.COMPLIANCE,
                f"{self._name}: in compliance: {settings.compliance_V:g} V do not drive {level} through the device; is "
                "it connected, is its resistance as expected? Raise driver.compliance_voltage as far as the device "
                "bears it, or lower limits.high",
            )
        tolerance = self._source.table.answer.current_tolerance * settings.range_A
        if reading.current_A is not None and abs(reading.current_A - amperes) > tolerance:
            said = "; ".join(self._source.errors()) or "its error queue is empty"
            raise DriverError(
                Fault.COMMAND_REFUSED,
                f"{self._name}: {level} was commanded, {reading.current_A / self._amperes:.6g} {unit} flows ({said})",
            )

    def _end(self, amperes: float) -> bool:
        """Command a current, switch off, disconnect; say so where the instrument does not confirm. Never raises.

        Returns:
            Whether the output is off, as far as is known: the instrument confirmed it, or it was not on.
        """
        is_off = True
        if self._is_on:
            self._is_on = False
            level, off, state = filled(self._commands.current, amperes), *self._commands[2:4]
            is_off = self._source.switch_off(level, off, state)
            if not is_off:
                logging.getLogger("rtctl").warning(
                    "%s: does not confirm that its output is off; switch it off by hand", self._name
                )
        if self._lease is not None:
            self._lease.end()
            self._lease = None
        self._source.close()
        if self._reference is not None:
            self._reference.meter.close()
        return is_off


def _factor(unit: str, to: str, what: str) -> float:
    """Return the value of one `unit` in `to`. Raises InputError that begins with `what`."""
    try:
        return convert(1.0, unit, to)
    except ValueError as error:
        raise InputError(f"{what}: {error}") from None


def _reader(unit: str, source: Instrument, settings: SourceSettings) -> Callable[[Reading, float], float]:
    """Return how a reading becomes a value in `unit`, given the current in force [A]. Raises InputError."""
    fields, name = source.table.answer.fields, source.name
    quantity = next((key for key, of_unit in UNITS.items() if _converts(of_unit, unit)), None)
    if quantity is None:
        raise InputError(f"{name}: reads resistance, voltage and current, the device is read in {unit}")
    factor = convert(1.0, UNITS[quantity], unit)
    if quantity in fields:
        return lambda reading, _: factor * float(getattr(reading, f"{quantity}_{UNITS[quantity]}"))
    if quantity == "resistance" and "voltage" in fields:
        if settings.has_zero:
            raise InputError(
                f"{name}: without a current there is no resistance; set limits.low and limits.safe above 0"
            )
        return lambda reading, amperes: factor * (reading.voltage_V or 0.0) / (reading.current_A or amperes)
    raise InputError(f"{name}: its table has no {quantity} among answer.fields, the device is read in {unit}")


def _converts(of_unit: str, unit: str) -> bool:
    try:
        convert(1.0, of_unit, unit)
    except ValueError:
        return False
    return True
