"""The manifest of a dataset (`dataset.toml`): what was measured, in which files, columns and units."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from rtctl.border.quantities import Checked, unit_registry


class Heading(Checked):
    """[dataset]"""

    name: str
    plant: Literal["oscillator", "vo2"]
    identity: str = ""
    """Which device answered, where the wire told."""
    description: str = ""


class Signal(Checked):
    """[signals.<name>]"""

    role: Literal["input", "output"]
    unit: str
    column: str | None = None
    hold: Literal["linear", "zero", "band-limited"] | None = None

    @field_validator("unit")
    @classmethod
    def _known_unit(cls, unit: str) -> str:
        try:
            unit_registry().Unit(unit)
        except Exception as error:  # pint raises a family of its own for what it cannot read
            raise ValueError(f'"{unit}" is not a unit that pint reads ({error})') from None
        return unit

    @model_validator(mode="after")
    def _hold_of_inputs(self) -> Signal:
        if self.hold is not None and self.role == "output":
            raise ValueError("hold says what an input does between its samples; an output has none")
        return self


class RecordTable(Checked):
    """[[records]]"""

    file: str
    sample_rate_hz: Annotated[float, Field(gt=0.0)] | None = None
    time: str | None = None
    resample: bool = False
    rows: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=1)]] | None = None
    ignore_first: Annotated[int, Field(ge=0)] = 0
    use: Literal["identify", "fit", "test"] = "fit"
    repeat: str | None = None
    initial: dict[str, Any] = {}
    conditions: dict[str, Any] = {}

    @model_validator(mode="after")
    def _one_time(self) -> RecordTable:
        if (self.sample_rate_hz is None) == (self.time is None):
            raise ValueError("give sample_rate_hz, or time (the name of a column in seconds), and not both")
        if self.rows is not None and not self.rows[0] < self.rows[1]:
            raise ValueError(f"rows = [{self.rows[0]}, {self.rows[1]}] selects nothing: first must be below last")
        return self


SIGNALS_OF = {
    "vo2": {"current": ("input", "mA"), "resistance": ("output", "ohm"), "deflection": ("output", "um")},
    "oscillator": {
        "drive": ("input", None),
        "displacement": ("output", None),
        "velocity": ("output", None),
    },
}
"""Signals of each kind of plant: role, and the unit they are converted to (None: the manifest's own)."""
REQUIRED_OF = {"vo2": ("current", "resistance"), "oscillator": ("drive", "displacement")}


class Manifest(Checked):
    """A whole `dataset.toml`."""

    dataset: Heading
    signals: dict[str, Signal]
    records: Annotated[tuple[RecordTable, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _signals_fit_the_plant(self) -> Manifest:
        from rtctl.border.errors import nearest

        known = SIGNALS_OF[self.dataset.plant]
        for name, signal in self.signals.items():
            if name not in known:
                raise ValueError(
                    f'[signals.{name}]: a "{self.dataset.plant}" has no such signal{nearest(name, known)}'
                )
            if signal.role != known[name][0]:
                raise ValueError(f'[signals.{name}]: role = "{signal.role}", {name} is an {known[name][0]}')
            unit = known[name][1]
            if unit is not None and not unit_registry().Unit(signal.unit).is_compatible_with(unit):
                raise ValueError(f'[signals.{name}]: unit "{signal.unit}" is not compatible with {unit}')
        for name in REQUIRED_OF[self.dataset.plant]:
            if name not in self.signals:
                raise ValueError(f'[signals.{name}] is missing: a "{self.dataset.plant}" needs it')
        return self
