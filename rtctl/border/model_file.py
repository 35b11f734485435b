"""A model file: nominal parameters with units, and the mechanisms that extend it.

The same file drives the simulated hardware, the estimator and the diagnosis, so it is read here, at the border.
What the names mean is the plant's: `Mechanism` and `Parameter` declare them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from rtctl.border.errors import InputError
from rtctl.border.units.quantities import Checked, check, convert, read_toml


class Value(Checked):
    """One number of a model: `{ value = 4.0, unit = "1/s", fixed = true, low = 3.9, high = 4.1 }`."""

    value: Annotated[float, Field(allow_inf_nan=False)]
    unit: str
    fixed: bool = False
    """Whether the value is known from elsewhere, so that a fit leaves it."""
    low: float | None = None
    """Lower end of the interval in which it is believed to lie, in its unit."""
    high: float | None = None
    standard_error: float | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Value:
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise ValueError(
                f"low = {self.low:g} {self.unit} must not exceed high = {self.high:g} {self.unit}"
            )
        return self

    def to(self, unit: str) -> float:
        """Return the number in `unit`. Raises ValueError in words where the units are not compatible."""
        return self.value if unit == self.unit else convert(self.value, self.unit, unit)


class MechanismTable(Checked):
    """Table [[model.mechanisms]]: an extension by its id."""

    id: str
    parameters: dict[str, Value] = Field(default_factory=dict)


def check_each_once(mechanisms: Sequence[MechanismTable]) -> None:
    """Raise ValueError where a mechanism is there twice."""
    ids = [mechanism.id for mechanism in mechanisms]
    twice = sorted({identity for identity in ids if ids.count(identity) > 1})
    if twice:
        raise ValueError(f"mechanism {', '.join(twice)} is there twice; keep one of each")


class ModelTable(Checked):
    """Table [model]."""

    kind: str
    parameters: dict[str, Value] = Field(default_factory=dict)
    mechanisms: tuple[MechanismTable, ...] = ()

    @model_validator(mode="after")
    def _each_once(self) -> ModelTable:
        check_each_once(self.mechanisms)
        return self


class ModelFile(Checked):
    """A whole model file of a plant whose parameters are plain numbers (kind "oscillator")."""

    model: ModelTable
    device: dict[str, Any] = Field(default_factory=dict)
    """Further data of a simulated device of this model (limits of its drive, instruments), read by `plant_sim`."""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Origin of the model: dataset and its hash, command, version."""

    @property
    def kind(self) -> str:
        """Kind of plant."""
        return self.model.kind

    def value(self, name: str, unit: str) -> float:
        """Return a nominal parameter in `unit`; a missing one is 0. Raises InputError for a unit that does not fit."""
        found = self.model.parameters.get(name)
        if found is None:
            return 0.0
        try:
            return found.to(unit)
        except ValueError as error:
            raise InputError(f"model.parameters.{name}: {error}") from None


def read_model_file(path: Path, kind: str) -> ModelFile:
    """Return the checked file. Raises InputError with every finding, also where it is of another kind."""
    tables = read_toml(path)
    table = tables.get("model")
    found = table.get("kind") if isinstance(table, dict) else None
    if found != kind:
        raise InputError(f'{path}: key "model.kind" is {found!r}, an "{kind}" model is needed here')
    return check(ModelFile, tables, str(path))
