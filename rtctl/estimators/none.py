"""No estimate: for excitations that are only recorded."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.interfaces import Estimate

NOTHING = Estimate(math.nan, math.nan, math.nan, 0)


class NoEstimator:
    """An estimator that estimates nothing."""

    surrogate = ("surrogate", "")

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Return an estimate of NaN."""
        return NOTHING

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return an estimate of NaN."""
        return NOTHING
