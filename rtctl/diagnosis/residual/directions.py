"""In which directions the outputs would move if an effect began to act: of each mechanism, and of forces of no name.

A direction is a derivative at the neutral value, by simulation: no measured signal is differentiated. Those of the
catalogue have a name to claim. Generic forces are the subject's: they catch what is in no catalogue and say along
which coordinate it lives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter, Simulation
from rtctl.diagnosis.problem.finite_differences import moves
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.shape_grid import shape_grid


class Direction(NamedTuple):
    """One way to depart from a hypothesis."""

    mechanism: str
    """Id, or "" for a generic force."""
    name: str
    """Parameter that moves, or the force."""
    coordinate: str
    """Along which a generic force lives; "" for a mechanism."""
    shapes: Mapping[str, float]
    scale: float
    """Size of one unit along it: parameter = scale x step."""
    record: int = -1
    """Of which it is the own; `ALL`: of all."""
    trials: int = 1
    """From how many shapes the data chose this one."""
    form: str = ""
    """Of its mechanism; directions of one form act together."""


ALL = -1


def catalogue_directions(
    simulation: Simulation, ids: tuple[str, ...], problem: Problem, residuals: Sequence[FloatArray]
) -> list[Direction]:
    """Of every mechanism in `ids` that the model does not have yet, form by form, shape by shape."""
    found = []
    for identity in ids:
        extended = simulation.extended((identity,))
        mechanism = extended.mechanisms[-1]
        units = parameters_of(extended, identity)
        forms = dict.fromkeys(mechanism.form_of(amplitude.name) for amplitude in mechanism.amplitudes)
        grid = [(form, one) for form in forms for one in shape_grid(mechanism, problem, residuals, form)]
        for form, (shapes, trials) in grid:
            for amplitude in mechanism.amplitudes:
                if mechanism.form_of(amplitude.name) != form:
                    continue
                size = _size(units[amplitude.name], problem.scales)
                records = range(len(problem.records)) if amplitude.per_record else (ALL,)
                found += [
                    Direction(identity, amplitude.name, "", shapes, size, record, trials, form)
                    for record in records
                ]
    return found


def parameters_of(simulation: Simulation, identity: str) -> dict[str, FreeParameter]:
    """By name, those of a mechanism that `simulation` has."""
    return {one.declared.name: one for one in simulation.parameters if one.mechanism == identity}


def acting_together(directions: Sequence[Direction], chosen: Sequence[int]) -> list[list[int]]:
    """`chosen` directions in groups of one mechanism, one form and one choice of shapes."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for k in chosen:
        one = directions[k]
        groups.setdefault((one.mechanism, one.form, *one.shapes.items()), []).append(k)
    return list(groups.values())


def _size(parameter: FreeParameter, scales: Scales) -> float:
    with np.errstate(all="ignore"):
        try:
            size = abs(float(parameter.declared.scale(scales)))
        except ZeroDivisionError:
            size = 0.0
    return size if np.isfinite(size) and size > 0.0 else 1.0


def mechanism_slopes(
    hypothesis: Hypothesis, directions: list[Direction], problem: Problem, index: int
) -> FloatArray:
    """(directions, outputs, n) of record `index`, all of one form of a mechanism: another may need shorter steps.

    Zero where a direction is another record's own, or no sensible step resolves it.
    """
    identity = directions[0].mechanism
    simulation = hypothesis.simulation.extended((identity,))
    at = {p.declared.name: k for k, p in enumerate(simulation.parameters) if p.mechanism == identity}
    neutral = [p.value for p in simulation.parameters[len(hypothesis.simulation.parameters) :]]
    base = np.append(hypothesis.values_of(index), neutral)
    record = problem.records[index]
    outputs = hypothesis.sensitivity.outputs
    slopes = np.zeros((len(directions), len(outputs), record.samples - record.first))
    left = [k for k, direction in enumerate(directions) if direction.record in (ALL, index)]
    for step in problem.subject.steps.sizes if left else ():
        lanes = np.tile(base, (1 + len(left), 1))
        for lane, k in enumerate(left, 1):
            for name, value in directions[k].shapes.items():
                lanes[lane, at[name]] = value
            lanes[lane, at[directions[k].name]] += step * directions[k].scale
        for name, value in directions[left[0]].shapes.items():  # or it alone may need the finest steps
            lanes[0, at[name]] = value
        start = np.tile(hypothesis.start(index), (len(lanes), 1))
        try:
            run = simulation.predict(record.stimulus, lanes, start, problem.steps_per_period)
        except ValueError:
            continue
        moved = np.stack([run.outputs[name][:, record.first :] for name in outputs], axis=1)
        moved = moved[1:] - moved[0]
        far = moves(moved, problem, outputs)
        slopes[[k for k, usable in zip(left, far.usable, strict=True) if usable]] = moved[far.usable] / step
        left = [k for k, small in zip(left, far.small, strict=True) if not small]
        if not left:
            break
    return slopes


def force_directions(problem: Problem) -> list[Direction]:
    """The forces of no name."""
    return [Direction("", force.name, force.coordinate, {}, 1.0) for force in problem.subject.forces]
