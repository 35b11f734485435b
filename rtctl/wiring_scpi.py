"""The part of the wiring that knows instruments: a table `[driver] kind = "scpi"` becomes a driver."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.border.errors import InputError
from rtctl.border.records import Channel, DeviceProfile, Driver
from rtctl.border.units.quantities import convert, parse_quantity
from rtctl.extras import require
from rtctl.scenario.instruments import InstrumentKeys, ReferenceKeys, Scpi
from rtctl.scenario.limits import ChannelLimits

if TYPE_CHECKING:
    from drivers.scpi.instrument import Instrument
    from drivers.scpi.ports import Place
    from drivers.scpi.settings import ReferenceMeter


def scpi(table: Scpi, profile: DeviceProfile, folder: Path, limits: ChannelLimits) -> Driver:
    """Return the driver of a source meter; nothing is sent yet.

    Args:
        table: `[driver]`.
        profile: channels of the device.
        folder: folder of the scenario, beside which tables are looked up.
        limits: of the commanded current; the driver holds them too.

    Raises:
        InputError: there is no such table, or instrument, settings and device do not fit.
    """
    from drivers.scpi.driver import ScpiDriver
    from drivers.scpi.settings import SourceSettings

    source, command = _instrument(table, folder), profile.commands[0]
    ampere = _ampere(command)
    settings = SourceSettings(
        compliance_V=table.compliance_voltage_V,
        low_A=ampere * min(limits.low, limits.safe_level),
        high_A=ampere * limits.high,
        safe_A=ampere * limits.safe_level,
        current_range_A=table.current_range_A,
        voltage_range_V=table.voltage_range_V,
        nplc=table.nplc,
        setup=table.setup,
    )
    reference = None if table.reference is None else _reference(table.reference, profile, folder)
    return ScpiDriver(source, settings, profile, reference)


def _ampere(command: Channel) -> float:
    """Return the value of one unit of the command in A. Raises InputError."""
    try:
        return convert(1.0, command.unit, "A")
    except ValueError:
        raise InputError(
            f'driver.kind = "scpi": the device must take a current, not {command.name} in {command.unit}'
        ) from None


def _instrument(keys: InstrumentKeys, folder: Path) -> Instrument:
    from drivers.scpi.instrument import Instrument
    from drivers.scpi.table import load_table

    return Instrument(load_table(keys.table, folder), _place(keys), keys.setup_timeout_s)


def _place(keys: InstrumentKeys) -> Place:
    from drivers.scpi.ports import serial_place, tcp_place, visa_place

    if keys.address is not None:
        return tcp_place(keys.address)
    if keys.port is not None:
        return serial_place(keys.port, keys.baud)
    require("pyvisa", "driver.visa")
    return visa_place(str(keys.visa), keys.visa_library)


def _reference(keys: ReferenceKeys, profile: DeviceProfile, folder: Path) -> ReferenceMeter:
    from drivers.scpi.settings import ReferenceMeter

    meter, unit = _instrument(keys, folder), profile.reference.unit
    values = (("voltage_range", keys.voltage_range_V), ("nplc", keys.nplc))
    if "voltage" not in meter.table.answer.fields:
        raise InputError(f"{meter.name}: as a voltmeter its table needs voltage among answer.fields")
    given = {name: value for name, value in values if value is not None}
    return ReferenceMeter(
        meter=meter,
        per_volt=_quantity("scale", keys.scale, f"({unit})/V"),
        offset=0.0 if keys.offset is None else _quantity("offset", keys.offset, unit),
        setup=(*meter.settings(given), *keys.setup),
    )


def _quantity(key: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(f"driver.reference.{key}: {error}") from None
