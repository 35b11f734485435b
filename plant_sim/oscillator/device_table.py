"""`[device]` of a model file: the driver and the instruments of a simulated device of this model.

The same file is simulated, fitted and served; everything here has a default but the units, which the model's
parameters may tell.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, create_model, model_validator

from plant_sim.bounds import FINITE, NOT_NEGATIVE, POSITIVE
from rtctl.border.errors import InputError
from rtctl.border.mechanisms import without_brackets
from rtctl.border.model_file import ModelFile
from rtctl.border.units.quantities import Checked, Quantity, check, unit_registry

AS_WRITTEN = re.compile(r"(?P<displacement>\(.+\)|\w+)/\(s\^2\*(?P<drive>\(.+\)|\w+)\)")
"""Form of the unit of `drive_gain`, which tells those of drive and displacement; m/s^2 alone does not."""
WIDEST_DRIVE = 1e6
"""Limit of a device that states none, in its unit."""


class DriveTable(Checked):
    """The `[device.drive]` table: limits of the command, and its level when the watchdog trips."""

    unit: str
    low: float = -WIDEST_DRIVE
    high: float = WIDEST_DRIVE
    safe: float = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> DriveTable:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} {self.unit} must be below high = {self.high:g} {self.unit}")
        if not self.low <= self.safe <= self.high:
            raise ValueError(f"safe = {self.safe:g} {self.unit} must lie in [{self.low:g}, {self.high:g}]")
        return self


class DisplacementTable(Checked):
    """The `[device.displacement]` table: the sensor."""

    unit: str
    noise: float = 0.0
    """Standard deviation of a reading."""
    reference_noise: float = 0.0
    """Standard deviation of a reading of the external instrument."""
    range: float = float("inf")
    """Range of the sensor: beyond plus or minus this it has no reading, a sensor fault."""
    broken_above: float = 1e9
    """Displacement at which the motion ends: the model has diverged, only a power cycle brings it back."""


class DeviceTable(Checked):
    """The `[device]` table."""

    name: Annotated[str, Field(pattern=r"^[\x20-\x7e]{1,16}$")]
    """Identity on the wire: printable ASCII, at most 16 characters."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the instruments' noise."""
    drive: DriveTable
    displacement: DisplacementTable


def read_device_table(model: ModelFile, path: Path) -> DeviceTable:
    """Read `[device]` of the model file at `path`, with defaults. Raises InputError with every finding."""
    tables = {key: dict(value) if isinstance(value, dict) else value for key, value in model.device.items()}
    tables.setdefault("name", path.stem.encode("ascii", "replace").decode()[:16])
    units = {}
    for signal, unit in _told_units(model).items():
        table = tables.setdefault(signal, {})
        if not isinstance(table, dict):
            raise InputError(f'{path}: key "device.{signal}" must be a table, got {table!r}')
        units[signal] = table.setdefault("unit", unit)
        if not isinstance(units[signal], str) or not units[signal]:
            raise InputError(
                f'{path}: key "device.{signal}.unit" is missing, and the parameters do not tell it; add '
                f'[device.{signal}] with a unit such as "{"mm" if signal == "displacement" else "m/s^2"}"'
            )
    try:
        table_type = _table_in(units["drive"], units["displacement"])
        return check(table_type, {"device": tables}, str(path)).device  # type: ignore[attr-defined,no-any-return]
    except ValueError as error:
        raise InputError(f"{path}: [device]: {error}") from None


def signal_units(model: ModelFile, source: str) -> dict[str, str]:
    """Return the units of drive and displacement that a model file tells by its parameters or its [device].

    Raises:
        InputError: It tells none; it names `source`, the file.
    """
    units = _told_units(model)
    for signal in units:
        table = model.device.get(signal)
        units[signal] = units[signal] or (str(table.get("unit", "")) if isinstance(table, dict) else "")
        if not units[signal]:
            raise InputError(
                f"{source}: the parameters do not tell the unit of {signal}; give [device.{signal}] with its unit such "
                f'as "{"mm" if signal == "displacement" else "V"}", or a dataset of the device'
            )
    return {signal: f"{unit_registry().parse_units(unit):~C}" for signal, unit in units.items()}


def _told_units(model: ModelFile) -> dict[str, str]:
    """Return the units of drive and displacement that `drive_gain` in {z}/(s^2 {u}) tells; "" if it does not."""
    gain = model.model.parameters.get("drive_gain")
    units = {"drive": "", "displacement": ""}
    if gain is None:
        return units
    if report := AS_WRITTEN.fullmatch(gain.unit):
        return {signal: without_brackets(unit) for signal, unit in report.groupdict().items()}
    try:
        powers = dict(unit_registry().parse_units(gain.unit)._units)
    except Exception:  # pint lets out whatever it stumbles on; the model's own reading says it in words
        return units
    if powers.pop("second", 0) == -2 and set(powers.values()) == {-1, 1} and len(powers) == 2:
        for unit, power in powers.items():
            units["displacement" if power == 1 else "drive"] = unit
    return units


@lru_cache
def _table_in(drive_unit: str, displacement_unit: str) -> type[Checked]:
    """Return the table with its quantities in the device's own units."""

    def quantity(unit: str, bound: Any) -> Any:
        return Annotated[float, Quantity(unit), bound]

    level, place = quantity(drive_unit, FINITE), displacement_unit
    drive: Any = create_model(
        "DriveTable",
        __base__=DriveTable,
        low=(level, -WIDEST_DRIVE),
        high=(level, WIDEST_DRIVE),
        safe=(level, 0.0),
    )
    displacement: Any = create_model(
        "DisplacementTable", __base__=DisplacementTable,
        noise=(quantity(place, NOT_NEGATIVE), 0.0), reference_noise=(quantity(place, NOT_NEGATIVE), 0.0),
        range=(quantity(place, Field(gt=0.0)), float("inf")), broken_above=(quantity(place, POSITIVE), 1e9),
    )  # fmt: skip
    device: Any = create_model(
        "DeviceTable", __base__=DeviceTable, drive=(drive, ...), displacement=(displacement, ...)
    )
    whole: type[Checked] = create_model("File", __base__=Checked, device=(device, ...))
    return whole
