"""[controller] kind = "pi" of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rtctl.border.units.quantities import Checked, Quantity
from rtctl.signals.gains import GainOf
from rtctl.signals.levels import Level, LevelOf


class PiTable(Checked):
    """[controller] kind = "pi": gains from the model with these margins, or by hand."""

    kind: Literal["pi"] = "pi"
    gain_margin: Annotated[float, Field(gt=1.0)] = 2.0
    phase_margin_rad: Annotated[float, Quantity("rad"), Field(alias="phase_margin", gt=0.0)] = (
        1.0471975511965976
    )
    kp: Annotated[float, GainOf(""), Field(ge=0.0, allow_inf_nan=False)] | None = None
    ki: Annotated[float, GainOf("/s"), Field(gt=0.0, allow_inf_nan=False)] | None = None
    feedforward: Literal["none", "inverse"] = "none"
    """inverse: the identified model's own current for the next setpoint, the PI corrects what it gets wrong."""
    deadband: Annotated[Level, LevelOf("output")] = Level(0.15, True)
    """Errors below this move nothing: inside the hysteresis the plant's gain is negative, and a PI would hunt."""

    @model_validator(mode="after")
    def _sound(self) -> PiTable:
        if (self.kp is None) != (self.ki is None):
            raise ValueError("kp and ki are set together, or neither (then the model's tuning applies)")
        if self.deadband.value < 0.0:
            raise ValueError(f"deadband = {self.deadband.value:g} must be >= 0")
        return self
