"""Values of the model file that the re-fit changed so much that a person should know."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

SHIFTED = (
    "the re-fit changed {}: the answer is about the model with these values. Are the units and signs of the data and "
    "of the model file right?"
)


class Shift(NamedTuple):
    """A value of the model file that the re-fit changed by far."""

    name: str
    before: float
    """Value of the file."""
    after: float
    """Value of the re-fit."""
    unit: str
    is_correction: bool
    """Whether the file's value is that of a correction without effect: an offset of 0."""


def find_large_shifts(given: Simulation, refitted: TestedHypothesis, problem: Problem) -> list[Shift]:
    """Find the values that the re-fit changed by far; `given` is the model of the file."""
    limits = problem.thresholds.nominal_fit
    shifted = []
    of_file = {one.name: one for one in given.parameters}
    for name, now in estimates_of(refitted, "").items():
        before = of_file[name]
        is_correction = before.declared.neutral == 0.0 and before.declared.default is not None
        if is_correction:
            most = limits.shifted_offset_scales * before.declared.scale(problem.scales)
            far = abs(now.value - before.value) > most
        else:
            possible = _includes(before.value, now.low, now.high, limits.shifted_value_ratio)
            far = before.value != 0.0 and not possible
        if far:
            shifted.append(Shift(name, before.value, now.value, plain_unit(now.unit), is_correction))
    return shifted


def note_large_shifts(shifts: Sequence[Shift], told: Collection[str] = ()) -> list[str]:
    """Note the values that the re-fit changed by far, without those that are `told` as causes."""
    texts = [
        f"{one.name} from {one.before:.4g} to {one.after:.4g} {one.unit}".rstrip()
        for one in shifts
        if one.name not in told
    ]
    return [SHIFTED.format(", ".join(texts))] if texts else []


def _includes(value: float, low: float, high: float, ratio: float) -> bool:
    """Return whether the interval from `low` to `high` has a value of the same sign and size within `ratio`."""
    if value == 0.0:
        return False
    smallest, largest = sorted((low / value, high / value))
    return largest >= 1.0 / ratio and smallest <= ratio
