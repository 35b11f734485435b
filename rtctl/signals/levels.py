"""Levels in a scenario: absolute with a unit, or in percent of a range that is known only later.

Which unit a level has is the device's: the profile comes with the validation's context, a VO2 actuator's without.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, ValidationInfo

from rtctl.border.arrays import FloatArray
from rtctl.border.records import VO2, DeviceProfile
from rtctl.border.units.quantities import parse_quantity


def whole_microseconds(period_s: float) -> None:
    """Return a period in whole microseconds.

    Raises ValueError if it has a fraction of one, which no device can have.
    """
    period_us = 1e6 * period_s
    if not (round(period_us) >= 1 and math.isclose(period_us, round(period_us), rel_tol=1e-9)):
        raise ValueError(f"period = {period_us:.10g} us must be whole microseconds: a device counts in them")


class Level(NamedTuple):
    """A level in the channel's unit, or in percent of its range if `relative`."""

    value: float
    relative: bool

    def resolve(self, low: float, high: float) -> float:
        """Return the level in the channel's unit; 0 % is `low`, 100 % is `high`."""
        return low + (high - low) * self.value / 100.0 if self.relative else self.value

    def resolve_width(self, low: float, high: float) -> float:
        """Return a difference of levels (an amplitude) in the channel's unit."""
        return (high - low) * self.value / 100.0 if self.relative else self.value


def parse_level(raw: Any, unit: str) -> Level:
    """Parse `"30 um"` or `"50 %"` (of the range)."""
    if isinstance(raw, Level):
        return raw
    if isinstance(raw, str) and raw.strip().endswith("%"):
        try:
            level = Level(float(raw.strip()[:-1]), True)
        except ValueError:
            raise ValueError(
                f'a level is "<number> {unit}" or "<number> %" of the range, got {raw!r}'
            ) from None
    else:
        level = Level(parse_quantity(raw, unit), False)
    if not math.isfinite(level.value):
        raise ValueError(f"a level must be finite, got {raw!r}")
    return level


def LevelOf(what: Literal["command", "output"]) -> BeforeValidator:
    """Return the annotation of a level in the unit of the device's first command, or of its controlled output."""

    def parse(raw: Any, info: ValidationInfo) -> Level:
        profile: DeviceProfile = (info.context or {}).get("profile", VO2)
        channel = profile.commands[0] if what == "command" else profile.reference
        return parse_level(raw, channel.unit)

    return BeforeValidator(parse)


def hold(values: Sequence[float] | FloatArray, samples: int) -> FloatArray:
    """Return each value repeated for `samples` samples (a staircase)."""
    return np.repeat(np.asarray(values, dtype=np.float64), samples)


def samples_in(duration_s: float, period_s: float, key: str) -> int:
    """Return the whole samples in a duration. Raises ValueError if it is not at least one period."""
    count = round(duration_s / period_s)
    if count < 1:
        raise ValueError(f"{key} = {duration_s:g} s is shorter than the loop's period {period_s:g} s")
    return count
