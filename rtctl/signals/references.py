"""References of the controlled output, in its unit: steps and sums of sines, as one value per sample."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import Checked, Quantity
from rtctl.signals.levels import Level, LevelOf, hold, samples_in


class Steps(Checked):
    """Levels held one after the other."""

    kind: Literal["steps"] = "steps"
    levels: Annotated[tuple[Annotated[Level, LevelOf("output")], ...], Field(min_length=1)]
    hold_s: Annotated[float, Quantity("s"), Field(alias="hold", gt=0.0, allow_inf_nan=False)]

    def build(self, time_s: FloatArray, low: float, high: float) -> FloatArray:
        """Return the reference at each time (n,); the list of levels starts over when it ends."""
        period_s = time_s[1] - time_s[0] if len(time_s) > 1 else self.hold_s
        values = [level.resolve(low, high) for level in self.levels]
        once = hold(values, samples_in(self.hold_s, period_s, "reference.hold"))
        return np.resize(once, len(time_s))


class Sine(Checked):
    """A component of a multisine."""

    amplitude: Annotated[Level, LevelOf("output")]
    frequency_hz: Annotated[float, Quantity("Hz"), Field(alias="frequency", gt=0.0, allow_inf_nan=False)]
    phase_rad: Annotated[float, Quantity("rad"), Field(alias="phase", allow_inf_nan=False)] = 0.0


class Multisine(Checked):
    """A multisine: offset + sum of amplitude sin(2 pi f t + phase)."""

    kind: Literal["multisine"] = "multisine"
    offset: Annotated[Level, LevelOf("output")]
    sines: Annotated[tuple[Sine, ...], Field(min_length=1)]

    def build(self, time_s: FloatArray, low: float, high: float) -> FloatArray:
        """Return the reference at each time (n,)."""
        value = np.full(len(time_s), self.offset.resolve(low, high))
        for sine in self.sines:
            phase = 2.0 * np.pi * sine.frequency_hz * time_s + sine.phase_rad
            value += sine.amplitude.resolve_width(low, high) * np.sin(phase)
        return value


Reference = Annotated[Steps | Multisine, Field(discriminator="kind")]
