"""[controller] kind = "pid" of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rtctl.border.units.quantities import Checked
from rtctl.signals.gains import GainOf


class PidTable(Checked):
    """[controller] kind = "pid": gains from the model with a bounded sensitivity, or by hand."""

    kind: Literal["pid"] = "pid"
    maximum_sensitivity: Annotated[float, Field(gt=1.05, le=4.0)] = 1.6
    """Largest |1/(1 + L)| over all frequencies and working points."""
    setpoint_weight: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Share of the setpoint in the proportional term: 1 answers fast, 0 overshoots least."""
    kp: Annotated[float | None, GainOf("")] = None
    ki: Annotated[float | None, GainOf("/s")] = None
    kd: Annotated[float | None, GainOf("*s")] = None

    @model_validator(mode="after")
    def _sound(self) -> PidTable:
        if (self.kp is None) != (self.ki is None) or (self.kd is not None and self.kp is None):
            raise ValueError(
                "kp and ki are set together, kd beside them, or none (then they are tuned on the model)"
            )
        return self
