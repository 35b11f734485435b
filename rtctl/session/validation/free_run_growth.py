"""Whether the free run of a record can be predicted: how far two runs from nearly the same start come apart."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.identification.simulation_error.trajectory_divergence import CHAOTIC_GROWTH, PERTURBATION

UNPREDICTABLE = (
    "record {}: its free run cannot be predicted: two runs from starts that differ by a hundred-millionth of the "
    "motion are {:,.0f} times further apart later. Its error says little of the model; rtctl identify and rtctl "
    "diagnose compare shorter pieces"
)


def measure_growth(
    simulation: Simulation, stimulus: Stimulus, values: FloatArray, course: FloatArray
) -> float:
    """Return the largest distance of two runs over that of their starts.

    Args:
        simulation: The model.
        stimulus: Inputs and start of the record.
        values: (parameters,) of the model.
        course: Simulated course (n,) of its first output, whose size scales the difference of the starts.

    Returns:
        The growth; 0 of a model without states, or of a course that does not move.
    """
    start = np.asarray(simulation.starting(stimulus, values), dtype=np.float64)
    size = float(np.std(course))
    if not len(start) or not size > 0.0:
        return 0.0
    nudged = start.copy()
    nudged[0] += PERTURBATION * size
    run = simulation.predict(stimulus, np.tile(values, (2, 1)), np.stack((start, nudged)))
    lanes = run.outputs[simulation.outputs[0]]
    with np.errstate(invalid="ignore"):
        return float(np.abs(np.nan_to_num(lanes[1] - lanes[0])).max()) / (PERTURBATION * size)


def is_unpredictable(growth: float) -> bool:
    """Return whether neighbouring runs part exponentially."""
    return growth > CHAOTIC_GROWTH


def describe_growth(record: str, growth: float) -> str:
    """Return the remark on a record whose free run cannot be predicted."""
    return UNPREDICTABLE.format(record, float(f"{growth:.0e}"))
