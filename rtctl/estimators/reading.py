"""No estimation: a reading is the controlled output, the first one that has its unit or the one that is named."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.border.records import DeviceProfile
from rtctl.border.units.quantities import convert
from rtctl.interfaces import Estimate


class ReadingEstimator:
    """`Estimator` that takes the first compatible reading for the output; NaN where no reading has its unit."""

    surrogate = ("surrogate", "")

    def __init__(self, profile: DeviceProfile, name: str = "") -> None:
        """Choose the reading of `name`; "": the first compatible one."""
        self.index, self.factor = -1, math.nan
        for index, channel in enumerate(profile.sensed):
            if name not in ("", channel.name):
                continue
            try:
                self.factor = convert(1.0, channel.unit, profile.reference.unit)
            except ValueError:
                continue
            self.index = index
            break

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Return the reading in the output's unit."""
        value = self.factor * sensed[self.index] if self.index >= 0 else math.nan
        return Estimate(value, math.nan, math.nan, 0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the reading in the output's unit."""
        return self.start(levels, sensed)
