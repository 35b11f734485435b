"""A model file of `kind = "fmu"`: a functional mock-up unit, which of its numbers a fit may move, mechanisms."""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from rtctl.border.equations.file import EquationsFile, Finite
from rtctl.border.model_file import MechanismTable, Value, check_each_once
from rtctl.border.units.quantities import Checked

KIND = "fmu"


class StartTable(Checked):
    """An entry of [model.states]: a parameter of the unit that is the value of a state when a record begins."""

    start: str
    """Name of that parameter in the unit."""
    unit: str
    variable: str = ""
    """Variable of the unit that is the state while it runs; "": it is not seen."""
    initial: Finite = 0.0
    """Value at the first sample of a record that states none, in `unit`."""
    fixed: bool = False
    """Whether the start is known, so that a fit leaves it."""

    def starting_at(self, value: float) -> StartTable:
        """Return the state with another initial value in its unit."""
        return self.model_copy(update={"initial": value})


class FmuTable(Checked):
    """Table [model]."""

    kind: str
    file: str
    """The unit; in a file relative to its folder, in memory absolute."""
    parameters: dict[str, Value] = Field(default_factory=dict)
    """Parameters of the unit by their names there; the others keep the values that the unit begins with."""
    states: dict[str, StartTable] = Field(default_factory=dict)
    mechanisms: tuple[MechanismTable, ...] = ()
    """What acts besides the unit, by the ids of the generic mechanisms."""

    @model_validator(mode="after")
    def _each_once(self) -> FmuTable:
        check_each_once(self.mechanisms)
        return self


class FmuFile(Checked):
    """A whole model file."""

    model: FmuTable
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Origin of the model: dataset and its hash, command, version."""

    @property
    def kind(self) -> str:
        """Kind of plant."""
        return self.model.kind


UserModel = EquationsFile | FmuFile
"""A model whose signals, states and parameters its user has named."""
