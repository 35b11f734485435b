"""What a source meter is set to, checked against its table before anything is sent."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.scpi.instrument import Instrument
from rtctl.border.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSettings:
    """What a source meter is set to before its output is switched on."""

    compliance_V: float
    """Largest voltage at the device."""
    low_A: float
    """Lowest current that the run commands, its safe one included."""
    high_A: float
    """Highest current that the run commands."""
    safe_A: float
    """Current at which the output is switched on, and to which it goes before it is switched off."""
    current_range_A: float | None = None
    """Range of the source; None: the larger of the limits."""
    voltage_range_V: float | None = None
    """Range of the voltmeter; None: the compliance voltage."""
    nplc: float | None = None
    """Integration time in power line cycles; None: the instrument's after a reset."""
    setup: tuple[str, ...] = ()
    """Further commands, after those of the table."""

    @property
    def largest_A(self) -> float:
        """Largest current that the run commands, without its sign."""
        return max(abs(self.low_A), abs(self.high_A))

    @property
    def range_A(self) -> float:
        """Range of the source."""
        return self.largest_A if self.current_range_A is None else self.current_range_A

    @property
    def has_zero(self) -> bool:
        """Whether the run may command no current at all."""
        return self.low_A <= 0.0 <= self.high_A


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceMeter:
    """An external instrument that measures the controlled output as a voltage."""

    meter: Instrument
    per_volt: float
    """Unit of the profile's reference per volt."""
    offset: float = 0.0
    """What 0 V stands for, in that unit."""
    setup: tuple[str, ...] = ()
    """Commands after those of its table."""


def refuse_misfits(source: Instrument, settings: SourceSettings) -> None:
    """Raise InputError where an instrument cannot be set as is asked."""
    heading, name = source.table.instrument, source.name
    if settings.largest_A > settings.range_A:
        raise InputError(
            f"{name}: driver.current_range = {settings.range_A:g} A is less than the current of [limits], "
            f"{settings.largest_A:g} A"
        )
    largest_A, largest_V = heading.largest_current_A or math.inf, heading.largest_voltage_V or math.inf
    if settings.range_A > largest_A:
        raise InputError(f"{name}: sources up to {largest_A:g} A, {settings.range_A:g} A are asked for")
    if not 0.0 < settings.compliance_V <= largest_V:
        raise InputError(
            f"{name}: driver.compliance_voltage = {settings.compliance_V:g} V must be above 0 V and at most "
            f"{largest_V:g} V"
        )
    if settings.nplc is not None and heading.nplc and not heading.nplc[0] <= settings.nplc <= heading.nplc[1]:
        raise InputError(
            f"{name}: driver.nplc = {settings.nplc:g} must be {heading.nplc[0]:g} to {heading.nplc[1]:g}"
        )


def setup_commands(source: Instrument, settings: SourceSettings) -> list[str]:
    """Return the commands of `settings`: the current comes last, once its range is set. Raises InputError."""
    values = {"compliance_voltage": settings.compliance_V, "current_range": settings.range_A}
    if settings.voltage_range_V is not None or source.table.commands.voltage_range is not None:
        values["voltage_range"] = settings.voltage_range_V or settings.compliance_V
    if settings.nplc is not None:
        values["nplc"] = settings.nplc
    return [*source.settings(values), *settings.setup, *source.settings({"current": settings.safe_A})]
