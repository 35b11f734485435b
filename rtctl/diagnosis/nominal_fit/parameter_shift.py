"""Values of the model's file that a re-fit moved so far that a person should know."""

from __future__ import annotations

from rtctl.border.mechanisms import Scales, plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

TIMES = 2.0
"""As large, or as small."""
SCALES = 10.0
"""Of an offset."""
MOVED = (
    "the re-fit has moved {}: the answer is about the model with these values. Are the units and signs of the data and "
    "of the model's file right?"
)


def far_off(given: Simulation, refitted: TestedHypothesis, scales: Scales) -> list[str]:
    """Of `given`, the model's file."""
    moved = []
    of_file = {one.name: one for one in given.parameters}
    for name, now in estimates_of(refitted, "").items():
        before = of_file[name]
        if before.declared.neutral == 0.0 and before.declared.default is not None:
            far = abs(now.value - before.value) > SCALES * before.declared.scale(scales)
        else:
            far = before.value != 0.0 and not _alike(before.value, now.low, now.high)
        if far:
            moved.append(f"{name} from {before.value:.4g} to {now.value:.4g} {plain_unit(now.unit)}".rstrip())
    return [MOVED.format(", ".join(moved))] if moved else []


def _alike(before: float, low: float, high: float) -> bool:
    """Whether a value between `low` and `high` may have the sign of `before`, and its size but for TIMES."""
    smallest, largest = sorted((low / before, high / before))
    return largest >= 1.0 / TIMES and smallest <= TIMES
