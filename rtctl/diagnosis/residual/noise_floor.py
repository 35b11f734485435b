"""How far a hypothesis is above what noise alone would leave."""

from __future__ import annotations

import math

from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


def noise_cost_of(examined: TestedHypothesis) -> float:
    """Half the sum of squares that noise alone would leave, on the scale of the fits' cost."""
    projected = examined.projected
    excess = projected.residual / max(projected.samples - projected.rank, 1)
    return examined.hypothesis.cost / max(excess, 1.0)


def left_over_noise(examined: TestedHypothesis) -> float:
    """RMS of what is left over that of noise alone: 1 where the set explains all of it."""
    return math.sqrt(examined.hypothesis.cost / noise_cost_of(examined)) if examined.hypothesis.cost else 1.0
