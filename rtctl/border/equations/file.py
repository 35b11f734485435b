"""A model file of `kind = "equations"`: a user's own equations with units, as its tables have them.

What the texts mean, `plant_sim.equations` knows; identification and other writers of models need the tables alone.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rtctl.border.model_file import MechanismTable, Value, check_each_once
from rtctl.border.units.quantities import Checked

KIND = "equations"


def _expression(raw: Any) -> str:
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        return repr(raw)
    if not isinstance(raw, str) or not raw.strip():
        raise ValueError(f'{raw!r} is no expression; write one in quotes, such as "-k*x"')
    return raw


def _finite(raw: Any) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not math.isfinite(raw):
        raise ValueError(f"{raw!r} is not a finite number")
    return float(raw)


def _term(raw: Any) -> Any:
    return raw if isinstance(raw, dict) else {"value": raw}


Expression = Annotated[str, BeforeValidator(_expression)]
Finite = Annotated[float, BeforeValidator(_finite)]


class InputTable(Checked):
    """An entry of [model.inputs]."""

    unit: str


class StateTable(Checked):
    """An entry of [model.states]."""

    unit: str
    rate: Expression
    """Time derivative."""
    initial: Finite = 0.0
    """Value at the first sample of a record that states none, in `unit`."""
    fixed: bool = False
    """Whether the start is known, so that a fit leaves it."""
    low: Finite | None = None
    """Value below which the state does not go, in `unit`: it stays there while its rate points outward."""
    high: Finite | None = None

    def starting_at(self, value: float) -> StateTable:
        """Return the state with another initial value in its unit: the nearest one that its limits allow."""
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return self.model_copy(update={"initial": min(max(value, low), high)})

    @model_validator(mode="after")
    def _ordered(self) -> StateTable:
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"low = {self.low:g} {self.unit} must be below high = {self.high:g} {self.unit}")
        for word, limit, outside in (
            ("low", self.low, self.low is not None and self.initial < self.low),
            ("high", self.high, self.high is not None and self.initial > self.high),
        ):
            if outside:
                raise ValueError(f"initial = {self.initial:g} {self.unit} is beyond {word} = {limit:g}")
        return self


class OutputTable(Checked):
    """An entry of [model.outputs]."""

    unit: str
    value: Expression


class TermTable(Checked):
    """An entry of [model.terms]: an expression that others name; or the expression alone."""

    value: Expression
    unit: str | None = None
    """Unit that it must have; None: whichever it has."""


class EventTable(Checked):
    """An entry of [model.events]: where an expression passes zero, states are set anew."""

    when: Expression
    """What passes zero."""
    direction: Literal["rising", "falling", "either"] = "either"
    """Which passages count: from below zero to above, from above to below, or both."""
    set: dict[str, Expression] = Field(min_length=1)
    """Value after the event by state, from the values just before it."""


class EquationsTable(Checked):
    """Table [model]."""

    kind: str
    python: str = ""
    """"module:Class" of a device whose functions the expressions call; "" where there is none."""
    inputs: dict[str, InputTable] = Field(default_factory=dict)
    states: dict[str, StateTable]
    outputs: dict[str, OutputTable]
    terms: dict[str, Annotated[TermTable, BeforeValidator(_term)]] = Field(default_factory=dict)
    parameters: dict[str, Value] = Field(default_factory=dict)
    events: dict[str, EventTable] = Field(default_factory=dict)
    mechanisms: tuple[MechanismTable, ...] = ()
    """What acts besides the equations, by the ids of the generic mechanisms."""

    @model_validator(mode="after")
    def _each_once(self) -> EquationsTable:
        check_each_once(self.mechanisms)
        return self


class EquationsFile(Checked):
    """A whole model file."""

    model: EquationsTable
    device: dict[str, Any] = Field(default_factory=dict)
    """Further data of a simulated device of this model, read by `plant_sim`."""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Origin of the model: dataset and its hash, command, version."""

    @property
    def kind(self) -> str:
        """Kind of plant."""
        return self.model.kind
