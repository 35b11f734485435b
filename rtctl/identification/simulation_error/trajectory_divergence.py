"""Whether two runs from nearly the same start part: then a long free run says nothing of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.initial_state import estimate_initial_state
from rtctl.identification.oscillator.weak_form import choose_half_width
from rtctl.identification.scales import estimate_scales

PERTURBATION = 1e-8
"""Of the motion's size."""
CHAOTIC_GROWTH = 1e4
"""Growth of a nudge: a free mass's grows with time, this much only what parts exponentially reaches."""
STEPS_PER_PERIOD = 64.0


class TrajectoryDivergence(NamedTuple):
    """Of the record in which it is largest."""

    record: str
    growth: float
    """Largest distance over the nudge."""
    rate: float
    """Mean exponential rate [1/s] until then: the largest Lyapunov exponent, roughly."""

    @property
    def is_chaotic(self) -> bool:
        """Whether the runs part exponentially."""
        return self.growth > CHAOTIC_GROWTH


def measure_divergence(
    simulation: Simulation, records: Sequence[FitRecord], values: FloatArray
) -> TrajectoryDivergence:
    """Runs of `values` (parameters,) from each record's start and from a nudge beside it."""
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
            worst = TrajectoryDivergence(record.name, float(distance[at]), rate)
    return worst
