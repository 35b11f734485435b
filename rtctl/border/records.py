"""Records and protocols between the loop, a driver and a device.

Quantities are in the units of the profile's channels; times in seconds unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, IntFlag
from typing import NamedTuple, Protocol


class DeviceStatus(IntFlag):
    """Status bits of register 104."""

    ENABLED = 1
    WATCHDOG_TRIPPED = 2
    CLAMPED = 4
    SENSOR_FAULT = 8
    REFUSED = 16


class SwitchedOff(Enum):
    """What the device has acknowledged of being switched off."""

    OFF = "off"
    SAFE = "safe"
    """The safe levels, but not that it is off."""
    SILENT = "silent"
    """Nothing."""


class Measurement(NamedTuple):
    """What one exchange brings back."""

    sensed: tuple[float, ...]
    """What the loop may use, in the profile's order and units."""
    reference: float
    """External instrument, for scoring only; NaN where there is none."""
    counter: int
    """Sample counter, uint32, wraps."""
    time_us: int
    """Device time [us], uint32, wraps."""
    sequence: int
    """Sequence number of the command in force, uint16."""
    status: int
    """`DeviceStatus` bits."""


class Mark(NamedTuple):
    """A moment of a run at which something was changed, as its picture marks it."""

    time_s: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One float32 quantity of a device and the register pair that carries it."""

    name: str
    unit: str
    register: int
    signed: bool = False
    """Whether a command may be negative."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceProfile:
    """Which quantities a kind of device takes and gives; the loop reads this instead of branching on it."""

    kind: str
    commands: tuple[Channel, ...]
    sensed: tuple[Channel, ...]
    reference: Channel

    @property
    def channels(self) -> tuple[Channel, ...]:
        """All of its quantities: commands, readings, reference."""
        return (*self.commands, *self.sensed, self.reference)

    def in_units(self, units: Mapping[str, str]) -> DeviceProfile:
        """Return the profile with other units, by name of channel; channels without one keep theirs."""

        def in_unit(channel: Channel) -> Channel:
            return replace(channel, unit=units.get(channel.name, channel.unit))

        return replace(
            self,
            commands=tuple(map(in_unit, self.commands)),
            sensed=tuple(map(in_unit, self.sensed)),
            reference=in_unit(self.reference),
        )


def device_profile(
    kind: str,
    *,
    commands: Mapping[str, str],
    sensed: Mapping[str, str],
    reference: tuple[str, str],
    signed: bool = True,
) -> DeviceProfile:
    """Return a profile with its channels laid out in the register map.

    Args:
        kind: name of the kind of plant.
        commands: unit of each command, by name.
        sensed: unit of each reading, by name.
        reference: name and unit of the controlled output as an external instrument measures it.
        signed: whether commands may be negative.

    Raises:
        ValueError: more channels than the map has room for, or two of one name.
    """
    named = [*commands, *sensed, reference[0]]
    if not commands or not sensed or len(commands) > 8 or len(sensed) > 6:
        raise ValueError(
            f"profile {kind}: 1 to 8 commands and 1 to 6 readings are needed, got {len(commands)} and {len(sensed)}"
        )
    if len(set(named)) < len(named):
        raise ValueError(f"profile {kind}: each channel needs a name of its own, got {', '.join(named)}")
    at_command = (0, *range(8, 8 + 2 * len(commands), 2))
    at_reading = (100, *range(110, 110 + 2 * len(sensed), 2))
    return DeviceProfile(
        kind=kind,
        commands=tuple(
            Channel(name=name, unit=unit, register=register, signed=signed)
            for (name, unit), register in zip(commands.items(), at_command, strict=False)
        ),
        sensed=tuple(
            Channel(name=name, unit=unit, register=register)
            for (name, unit), register in zip(sensed.items(), at_reading, strict=False)
        ),
        reference=Channel(name=reference[0], unit=reference[1], register=107),
    )


VO2 = DeviceProfile(
    kind="vo2",
    commands=(Channel(name="current", unit="mA", register=0),),
    sensed=(Channel(name="resistance", unit="ohm", register=100),),
    reference=Channel(name="deflection", unit="um", register=107),
)

ME = DeviceProfile(
    kind="me",
    commands=(
        Channel(name="coil_current", unit="mA", register=0),
        Channel(name="drive_frequency", unit="Hz", register=8),
    ),
    sensed=(
        Channel(name="in_phase", unit="um", register=100),
        Channel(name="quadrature", unit="um", register=110),
    ),
    reference=Channel(name="amplitude", unit="um", register=107),
)


def oscillator_profile(*, drive_unit: str, displacement_unit: str) -> DeviceProfile:
    """Return the profile of an oscillator whose model file has these units."""
    return DeviceProfile(
        kind="oscillator",
        commands=(Channel(name="drive", unit=drive_unit, register=0, signed=True),),
        sensed=(Channel(name="displacement", unit=displacement_unit, register=100),),
        reference=Channel(name="reference_displacement", unit=displacement_unit, register=107),
    )


OSCILLATOR = oscillator_profile(drive_unit="V", displacement_unit="um")


class Device(Protocol):
    """A device as its wire sees it: register semantics without the bytes.

    Commands and readings are float32 on every path, so a run in-process and one over a wire agree to the bit.
    """

    profile: DeviceProfile
    identity: str

    def exchange(self, levels: Sequence[float], sequence: int) -> Measurement:
        """Write command and sequence number and read 100-111 in one transaction. Raises ValueError on a NaN."""
        ...

    def read(self) -> Measurement:
        """Read registers 100-111 without a command."""
        ...

    def set_enable(self, on: bool) -> None:
        """Write register 3; off, then on, clears a tripped watchdog."""
        ...

    def set_watchdog(self, period_ms: int) -> None:
        """Write register 4, the watchdog [ms]; 0: none."""
        ...

    def set_clock(self, *, lockstep: bool, period_us: int) -> None:
        """Write registers 5 and 6-7: clock and sample period."""
        ...


class Driver(Protocol):
    """One end of a wire. Raises `DriverError` with a named fault, never returns data it does not trust."""

    profile: DeviceProfile
    identity: str

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Connect, set clock and watchdog, enable, read once. `lockstep_period_us=None`: free-running."""
        ...

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Send one command, return the reply that belongs to it (its sequence number is checked)."""
        ...

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff | None:
        """Command the safe levels as far as the wire still carries them, disable, disconnect. Never raises.

        Returns:
            What the device acknowledged of it; None: this driver does not say.
        """
        ...
