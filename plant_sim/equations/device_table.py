"""`[device]` of a model of equations: limits of its inputs, noise of its outputs; all of it has defaults."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import Checked, check

WIDEST = 1e6
"""Limit of an input that states none, in its unit."""


class InputLimits(Checked):
    """An entry of [device.inputs], in the unit of the model's input."""

    low: float = -WIDEST
    high: float = WIDEST
    safe: float = 0.0
    """Level that the device takes when its watchdog trips."""

    @model_validator(mode="after")
    def _ordered(self) -> InputLimits:
        if not self.low <= self.safe <= self.high or not self.low < self.high:
            raise ValueError(
                f"low = {self.low:g}, safe = {self.safe:g}, high = {self.high:g} must rise in this order"
            )
        return self


class Instrument(Checked):
    """An entry of [device.outputs]."""

    noise: Annotated[float, Field(ge=0.0)] = 0.0
    """Standard deviation of a reading, in the unit of the model's output."""
    sensed: bool = True
    """Whether the loop may use it; else an external instrument alone reads it, as `reference`."""
    low: float | None = None
    """Lowest value that a loop may ask for, in the unit of the model's output."""
    high: float | None = None
    """Highest value that a loop may ask for."""

    @model_validator(mode="after")
    def _ordered(self) -> Instrument:
        if (self.low is None) != (self.high is None):
            raise ValueError("low and high are given together: the range of a controlled output")
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must be below high = {self.high:g}")
        return self


class DeviceTable(Checked):
    """The `[device]` table."""

    name: Annotated[str, Field(pattern=r"^[\x20-\x7e]{1,16}$")]
    """Identity on the wire: printable ASCII, at most 16 characters."""
    seed: Annotated[int, Field(ge=0)] = 0
    inputs: dict[str, InputLimits] = Field(default_factory=dict)
    outputs: dict[str, Instrument] = Field(default_factory=dict)
    reference: str = ""
    """Output that an external instrument reads without noise; "": the first one."""


class _Whole(Checked):
    device: DeviceTable


def read_device_table(model: EquationsFile, path: Path) -> DeviceTable:
    """Read `[device]` of the model file at `path`, with defaults. Raises InputError with every finding."""
    tables = {"name": path.stem.encode("ascii", "replace").decode()[:16], **model.device}
    found = check(_Whole, {"device": tables}, str(path)).device
    declared: dict[str, list[str]] = {
        "inputs": list(model.model.inputs),
        "outputs": list(model.model.outputs),
    }
    lines = [
        f'{path}: unknown key "device.{word}.{name}": the model has no such {word[:-1]}{nearest(name, declared[word])}'
        for word in declared
        for name in getattr(found, word)
        if name not in declared[word]
    ]
    if found.reference and found.reference not in model.model.outputs:
        lines.append(
            f'{path}: key "device.reference": the model has no output "{found.reference}"'
            f"{nearest(found.reference, model.model.outputs)}"
        )
    shown = found.reference or next(iter(model.model.outputs))
    hidden = [name for name, one in found.outputs.items() if not one.sensed]
    lines += [
        f'{path}: key "device.outputs.{name}.sensed": only device.reference may be hidden from the loop'
        for name in hidden
        if name != shown and name in model.model.outputs
    ]
    if hidden and len(hidden) == len(model.model.outputs):
        lines.append(
            f'{path}: key "device.outputs.{shown}.sensed": the loop needs another output that it may read'
        )
    if lines:
        raise InputError("\n".join(lines))
    return found
