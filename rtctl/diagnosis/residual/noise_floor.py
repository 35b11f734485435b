"""How far a hypothesis is above what noise alone would leave."""

from __future__ import annotations

import math

from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


def noise_cost_of(tested: TestedHypothesis) -> float:
    """Return the cost that noise alone would leave: half a sum of squares, on the scale of the fits' cost."""
    projected = tested.projected
    excess = projected.residual / max(projected.samples - projected.rank, 1)
    return tested.hypothesis.cost / max(excess, 1.0)


def residual_over_noise(tested: TestedHypothesis) -> float:
    """Return the RMS of the residual over that of noise alone: 1 where the hypothesis explains all of it."""
    return math.sqrt(tested.hypothesis.cost / noise_cost_of(tested)) if tested.hypothesis.cost else 1.0
