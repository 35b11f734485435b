"""Values and starts of the model file that the re-fit changed so much that a person should know."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.stats import t as student

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.border.statistics import NORMAL_95
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.measured.dataset import Dataset

NO_ERRORS: Mapping[str, float] = MappingProxyType({})
SHIFTED = (
    "the re-fit changed {}: the answer is about the model with these values. Are the units and signs of the data and "
    "of the model file right? If they are, these values may hold an effect that the model lacks: write fixed = true to "
    "those that you know"
)
STARTS = (
    "all fitted records begin at {}: if the device does begin as the model file says, write fixed = true to these "
    "states, and what moved their starts shows"
)


def was_identified_from(model: Any, dataset: Dataset) -> bool:
    """Return whether a model file says that it was identified from this very dataset.

    Its values are then no one's knowledge of the device: what moves them is told as causes, or as what is left.
    """
    stated = getattr(model, "provenance", {}).get("sha256", {})
    path = dataset.path
    return path.is_file() and stated.get(path.name) == hashlib.sha256(path.read_bytes()).hexdigest()


def note_large_shifts(
    given: Simulation,
    kept: TestedHypothesis,
    problem: Problem,
    told: Collection[str] = (),
    errors: Mapping[str, float] = NO_ERRORS,
) -> list[str]:
    """Note the values that the re-fit changed by far, without those that are `told` as causes.

    A value that stays within the 95 % interval that the file states for it has not changed.

    Args:
        given: The model of the file.
        kept: The fit that the answer is about: with its causes, which may bring a value back to the file's.
        problem: Records that were fitted.
        told: Ids of causes: `parameter.NAME`, or of a mechanism that a parameter imitates.
        errors: Standard errors over values that the file states, by parameter.
    """
    limits = problem.thresholds.nominal_fit
    shifted = []
    of_file = {one.name: one for one in given.parameters}
    for name, now in estimates_of(kept, "").items():
        before = of_file[name]
        if before.declared.neutral == 0.0 and before.declared.default is not None:
            most = limits.shifted_offset_scales * before.declared.scale(problem.scales)
            far = abs(now.value - before.value) > most
        else:
            possible = _includes(before.value, now.low, now.high, limits.shifted_value_ratio)
            stated = NORMAL_95 * errors.get(name, 0.0) * abs(before.value)
            near = now.low <= before.value + stated and now.high >= before.value - stated
            far = before.value != 0.0 and not possible and not near
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


def note_common_starts(refitted: TestedHypothesis, problem: Problem) -> list[str]:
    """Note the states whose fitted starts all records put off the model file's by the same, if the file's could be.

    A constant input of a state that nobody reads is another start of all records. The mean over the records is held
    against their scatter (Student's t).

    Args:
        refitted: The re-fitted model.
        problem: Records that were fitted.
    """
    hypothesis, limits = refitted.hypothesis, problem.thresholds.nominal_fit
    simulation, units = hypothesis.simulation, problem.subject.state_units
    given = np.array([simulation.starting(one.stimulus, hypothesis.values) for one in problem.records])
    found = hypothesis.starts[:, : hypothesis.states]
    told = []
    for k, name in enumerate(simulation.state):
        free = [r for r, one in enumerate(problem.records) if name not in one.stimulus.initial]
        off, least = (found - given)[free, k], limits.common_start_p
        if name not in units or len(free) < 2 or np.ptp(given[free, k]) > 0.0:
            continue
        error = float(off.std(ddof=1)) / np.sqrt(len(free))
        if abs(off.mean()) > error * float(student.isf(0.5 * least / len(simulation.state), len(free) - 1)):
            now = f"{found[free, k].mean():.3g} {plain_unit(units[name])}".rstrip()
            told.append(f"{name} = {now} and not {given[free[0], k]:.3g}")
    return [STARTS.format(", ".join(told))] if told else []
