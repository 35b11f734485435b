"""[scenario.channels]: commands, readings and controlled output of a device whose model names them.

A scenario need not have the table: it is filled from the model file of `scenario.model`, and recorded with the run, so
that a recording is read without the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, model_validator

from rtctl.border.errors import InputError
from rtctl.border.records import DeviceProfile, device_profile
from rtctl.border.units.quantities import Checked, check, convert
from rtctl.registry import PlantKind
from rtctl.scenario.limits import LimitsTable


def known_unit(unit: str) -> str:
    """Return `unit`. Raises ValueError where it is none."""
    convert(1.0, unit, unit)
    return unit


Unit = Annotated[str, AfterValidator(known_unit)]


class ControlledOutput(Checked):
    """The output that the loop controls, as an external instrument reads it."""

    name: str
    unit: Unit


class ChannelsTable(Checked):
    """Names and units of a device's channels, in the order of its registers."""

    commands: dict[str, Unit]
    sensed: dict[str, Unit]
    reference: ControlledOutput

    @model_validator(mode="after")
    def _has_places(self) -> ChannelsTable:
        self.profile("equations")
        names = (*self.commands, *self.sensed, self.reference.name)
        for name in names:
            if name in LimitsTable.model_fields:
                raise ValueError(
                    f'a channel cannot be named "{name}", which is a key of [limits]; rename it in the model'
                )
        return self

    def profile(self, kind: str) -> DeviceProfile:
        """Return the profile of a device of `kind`. Raises ValueError where the registers have no room for it."""
        reference = (self.reference.name, self.reference.unit)
        return device_profile(kind, commands=self.commands, sensed=self.sensed, reference=reference)


class _Heading(Checked):
    channels: ChannelsTable


class _Whole(Checked):
    scenario: _Heading


def fill_channels(tables: dict[str, Any], kind: PlantKind, folder: Path, source: str) -> None:
    """Write `scenario.channels` from the model file of `scenario.model` into `tables`, unless it is there.

    Args:
        tables: A scenario of `kind`, changed in place.
        kind: Kind of plant whose models name the channels.
        folder: Folder beside which the model is looked up.
        source: The scenario's name in messages.

    Raises:
        InputError: No model is named, or it is wrong.
    """
    heading = tables.get("scenario")
    if not isinstance(heading, dict) or "channels" in heading:
        return
    model = heading.get("model")
    if not isinstance(model, str):
        raise InputError(
            f'{source}: key "scenario.model" is missing: the inputs and outputs of a model file are the channels of '
            f'a device of "{kind.name}"; name it, or give [scenario.channels]'
        )
    file = folder / model
    if not file.is_file():
        raise InputError(f'{source}: key "scenario.model": there is no file {file}')
    profile: DeviceProfile = kind.part(kind.device_profile)(file)
    heading["channels"] = {
        "commands": {one.name: one.unit for one in profile.commands},
        "sensed": {one.name: one.unit for one in profile.sensed},
        "reference": {"name": profile.reference.name, "unit": profile.reference.unit},
    }


def profile_of(tables: dict[str, Any], kind: PlantKind, source: str) -> DeviceProfile:
    """Return the profile that `scenario.channels` of `tables` describes. Raises InputError."""
    heading = tables.get("scenario")
    channels = heading.get("channels") if isinstance(heading, dict) else None
    found = check(_Whole, {"scenario": {"channels": channels}}, source)
    return found.scenario.channels.profile(kind.name)
