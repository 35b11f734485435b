"""Values of the model file that the re-fit changed so much that a person should know."""

from __future__ import annotations

from collections.abc import Collection

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

SHIFTED = (
    "the re-fit changed {}: the answer is about the model with these values. Are the units and signs of the data and "
    "of the model file right?"
)


def note_large_shifts(
    given: Simulation, refitted: TestedHypothesis, problem: Problem, told: Collection[str] = ()
) -> list[str]:
    """Note the values that the re-fit changed by far, without those that are `told` as causes.

    Args:
        given: The model of the file.
        refitted: The same, re-fitted.
        problem: Records that were fitted.
        told: Ids of causes: `parameter.NAME`, or of a mechanism that a parameter imitates.
    """
    limits = problem.thresholds.nominal_fit
    shifted = []
    of_file = {one.name: one for one in given.parameters}
    for name, now in estimates_of(refitted, "").items():
        before = of_file[name]
        if before.declared.neutral == 0.0 and before.declared.default is not None:
            most = limits.shifted_offset_scales * before.declared.scale(problem.scales)
            far = abs(now.value - before.value) > most
        else:
            possible = _includes(before.value, now.low, now.high, limits.shifted_value_ratio)
            far = before.value != 0.0 and not possible
        if far and not {f"parameter.{name}", *before.declared.imitates} & set(told):
            text = f"{name} from {before.value:.4g} to {now.value:.4g} {plain_unit(now.unit)}"
            shifted.append(text.rstrip())
    return [SHIFTED.format(", ".join(shifted))] if shifted else []


def _includes(value: float, low: float, high: float, ratio: float) -> bool:
    """Return whether the interval from `low` to `high` has a value of the same sign and size within `ratio`."""
    if value == 0.0:
        return False
    smallest, largest = sorted((low / value, high / value))
    return largest >= 1.0 / ratio and smallest <= ratio
