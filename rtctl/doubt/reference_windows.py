"""What the model got wrong before, where the device moved in the same way: the measure of a window of today.

An error of the model is no noise: on the same motion it is the same again, and it changes with the motion. So a
window is compared with the one of the past whose motion was nearest, at a distance d, and what it may differ by is

    variance = v_past + v_floor + v_model (1 - exp(-2 d / L))

(the structure function of a first-order process along the motion, as the thermal observer has it). A window of new
motion that agrees is kept, with this variance as its own: what is learned late counts for less, and a slow change on a
motion that is known is never learned at all. At most `MOST` windows are kept.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

MOST = 256
LENGTH = 0.05
"""Distance L over which a model's error changes, of the range."""
NEW = 0.02
"""Distance beyond which a motion is new."""


class Compared(NamedTuple):
    """A window beside the nearest one of the past."""

    z: FloatArray
    """Differences (n,) in standard deviations."""
    variance: FloatArray
    """Variances (n,)."""
    distance: float


class ReferenceWindows:
    """Windows of the past: motion, numbers, variances."""

    def __init__(self, floor: FloatArray, model: FloatArray) -> None:
        """Start without any.

        Args:
            floor: variance of each number between two windows of the same motion (n,).
            model: variance of each number over all motions (n,).
        """
        self.floor, self.model = floor, model
        self._motions: list[FloatArray] = []
        self._numbers: list[FloatArray] = []
        self._variances: list[FloatArray] = []

    def __len__(self) -> int:
        return len(self._motions)

    def add(self, motion: FloatArray, numbers: FloatArray, variances: FloatArray) -> None:
        """Keep a window; of more than `MOST` the surest ones stay."""
        self._motions.append(motion)
        self._numbers.append(numbers)
        self._variances.append(variances)
        if len(self) > MOST:
            worst = int(np.argmax([float(np.nansum(one)) for one in self._variances]))
            for kept in (self._motions, self._numbers, self._variances):
                kept.pop(worst)

    def compare(self, motion: FloatArray, numbers: FloatArray) -> Compared:
        """Compare a window with the past; without a past with the model alone, whose numbers are 0."""
        if not self._motions:
            variance = self.floor + self.model
            return Compared(numbers / np.sqrt(variance), variance, math.inf)
        away = np.max(np.abs(np.array(self._motions) - motion), axis=1)
        nearest = int(np.argmin(away))
        distance = float(away[nearest])
        grown = 1.0 - math.exp(-2.0 * distance / LENGTH)
        variance = self._variances[nearest] + self.floor + self.model * grown
        return Compared((numbers - self._numbers[nearest]) / np.sqrt(variance), variance, distance)
