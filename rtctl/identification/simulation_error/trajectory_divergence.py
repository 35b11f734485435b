"""Divergence of neighbouring trajectories: where it is exponential, a long free run does not fix the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.initial_state import estimate_initial_state
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.scales import estimate_scales

PERTURBATION = 1e-8
"""Perturbation of the start relative to the size of the motion."""
CHAOTIC_GROWTH = 1e4
"""Growth of the perturbation above which motion is chaotic; that of a free mass grows only linearly with time."""
STEPS_PER_PERIOD = 64.0
UNBOUNDED = 100.0
"""Multiple of the measured displacement's RMS that no motion of the device reaches."""


class TrajectoryDivergence(NamedTuple):
    """Divergence in the record where it is largest."""

    record: str
    growth: float
    """Largest distance over the perturbation."""
    rate: float
    """Mean exponential rate [1/s] up to there, roughly the largest Lyapunov exponent."""
    runs_away: bool = False
    """Whether the run itself leaves the measured motion far behind: the model is unstable there, and so is the plant,
    held by feedback, or the model is wrong."""

    @property
    def is_chaotic(self) -> bool:
        """Whether the trajectories diverge exponentially."""
        return self.growth > CHAOTIC_GROWTH


def measure_divergence(
    simulation: Simulation, records: Sequence[FitRecord], values: FloatArray
) -> TrajectoryDivergence:
    """Run `values` (parameters,) from each record's start and from a perturbed one; return the largest divergence."""
    scales = estimate_scales(records)
    width_s = choose_half_width(records, scales.rate)
    worst = TrajectoryDivergence(records[0].name, 0.0, 0.0)
    for record in records:
        start = estimate_initial_state(record, 0, width_s, simulation.state)
        nudged = start.copy()
        nudged[0] += PERTURBATION * scales.displacement
        try:
            run = simulation.predict(
                record.stimulus, np.tile(values, (2, 1)), np.stack((start, nudged)), STEPS_PER_PERIOD
            )
        except ValueError:
            continue
        lanes = run.outputs[simulation.outputs[0]]
        distance = np.abs(np.nan_to_num(lanes[1] - lanes[0])) / (PERTURBATION * scales.displacement)
        at = int(distance.argmax())
        if distance[at] > worst.growth:
            rate = float(np.log(max(distance[at], 1.0))) / max(at * record.period_s, record.period_s)
            away = not np.abs(lanes[0]).max() < UNBOUNDED * scales.displacement
            worst = TrajectoryDivergence(record.name, float(distance[at]), rate, away)
    return worst
