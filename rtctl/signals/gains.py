"""Gains in a scenario: in the unit of the device's first command over that of its controlled output.

Which units these are is the device's: the profile comes with the validation's context. Without one a gain is a number.
"""

from __future__ import annotations

from typing import Any

from pydantic import BeforeValidator, ValidationInfo

from rtctl.border.records import DeviceProfile
from rtctl.border.units.quantities import parse_quantity


def gain_unit(profile: DeviceProfile) -> str:
    """Return the unit of a proportional gain, such as mA/um or V/K."""
    command, output = (_bracketed(one.unit or "1") for one in (profile.commands[0], profile.reference))
    return f"{command}/{output}"


def GainOf(over: str) -> BeforeValidator:
    """Return the annotation of a gain; `over` is what stands behind its unit: "", "/s" or "*s"."""

    def parse(raw: Any, info: ValidationInfo) -> float | None:
        profile = (info.context or {}).get("profile")
        if raw is None or profile is None:
            return raw if raw is None else float(raw)
        return parse_quantity(raw, f"{gain_unit(profile)}{over}")

    return BeforeValidator(parse)


def _bracketed(unit: str) -> str:
    return f"({unit})" if any(sign in unit for sign in "*/ ") else unit
