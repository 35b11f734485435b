"""[controller] kind = "pid" of a scenario."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from rtctl.border.units.quantities import Checked, parse_quantity


def _gain(over: str) -> BeforeValidator:
    """Return the annotation of a gain in the unit of the first command over that of the controlled output."""

    def parse(raw: Any, info: ValidationInfo) -> float | None:
        profile = (info.context or {}).get("profile")
        if raw is None or profile is None:
            return raw if raw is None else float(raw)
        command, output = (_bracketed(one.unit or "1") for one in (profile.commands[0], profile.reference))
        return parse_quantity(raw, f"{command}/{output}{over}")

    return BeforeValidator(parse)


def _bracketed(unit: str) -> str:
    return f"({unit})" if any(sign in unit for sign in "*/ ") else unit


class PidTable(Checked):
    """[controller] kind = "pid": gains from the model with a bounded sensitivity, or by hand."""

    kind: Literal["pid"] = "pid"
    maximum_sensitivity: Annotated[float, Field(gt=1.05, le=4.0)] = 1.6
    """Largest |1/(1 + L)| over all frequencies and working points."""
    setpoint_weight: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Share of the setpoint in the proportional term: 1 answers fast, 0 overshoots least."""
    kp: Annotated[float | None, _gain("")] = None
    ki: Annotated[float | None, _gain("/s")] = None
    kd: Annotated[float | None, _gain("*s")] = None

    @model_validator(mode="after")
    def _sound(self) -> PidTable:
        if (self.kp is None) != (self.ki is None) or (self.kd is not None and self.kp is None):
            raise ValueError(
                "kp and ki are set together, kd beside them, or none (then they are tuned on the model)"
            )
        return self
