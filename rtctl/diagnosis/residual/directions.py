"""Directions in which the outputs would move if an effect began to act: mechanisms of the catalogue, generic forces.

A direction is the derivative of a simulation at the neutral value of a parameter; no measured signal is
differentiated. Directions of the catalogue have a name to claim. Generic forces are those of the kind of plant: they
catch what is in no catalogue, and tell along which coordinate it lives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter, HasDepartures, Prediction, Simulation, Stimulus
from rtctl.diagnosis.problem.finite_differences import check_differences
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.shape_grid import shape_grid

ALL = -1
"""Index that stands for all records."""
MEMORY = "memory"
"""Coordinate of the directions along past motion and drive."""


class Direction(NamedTuple):
    """One way to depart from a hypothesis."""

    mechanism: str
    """Id of the mechanism, or "" for a generic force."""
    name: str
    """Parameter that moves, or the force."""
    coordinate: str
    """Coordinate along which a generic force lives; "" for a mechanism."""
    shapes: Mapping[str, float]
    """Shapes of the mechanism, by name, in units."""
    scale: float
    """Change of the parameter by one unit along the direction, in its unit."""
    record: int = ALL
    """Index of the record that has the parameter for itself; `ALL`: all share it."""
    trials: int = 1
    """Number of shapes among which the data chose this one; the p-value is multiplied by it."""
    form: str = ""
    """Form of its mechanism; directions of one form act together."""
    least: float = -np.inf
    """Lowest step along the direction, in its unit, that the bounds of its parameter allow: 0 of a friction."""
    most: float = np.inf
    """Highest such step."""


def catalogue_directions(
    simulation: Simulation, ids: tuple[str, ...], problem: Problem, residuals: Sequence[FloatArray]
) -> list[Direction]:
    """List the directions of mechanisms, form by form and shape by shape.

    Args:
        simulation: Model that does not have these mechanisms yet.
        ids: Ids of the mechanisms.
        problem: Problem with the scales of the amplitudes.
        residuals: Residual (outputs, n) of each record, whose spectrum suggests frequencies.
    """
    return [
        direction
        for identity in ids
        for direction in _mechanism_directions(simulation, identity, problem, residuals)
    ]


def _mechanism_directions(
    simulation: Simulation, identity: str, problem: Problem, residuals: Sequence[FloatArray]
) -> list[Direction]:
    extended = simulation.extended((identity,))
    mechanism = extended.mechanisms[-1]
    if not mechanism.suits_data:
        return []
    parameters = parameters_by_name(extended, identity)
    forms = dict.fromkeys(mechanism.form_of(amplitude.name) for amplitude in mechanism.amplitudes)
    directions = []
    for form in forms:
        amplitudes = [one for one in mechanism.amplitudes if mechanism.form_of(one.name) == form]
        for shapes, trials in shape_grid(mechanism, problem, residuals, form):
            shaped = mechanism.form_at(form, shapes)
            for amplitude in amplitudes:
                parameter = parameters[amplitude.name]
                scale = _amplitude_scale(parameter, problem.scales)
                least, most = ((bound - parameter.value) / scale for bound in (parameter.low, parameter.high))
                records = range(len(problem.records)) if amplitude.per_record else (ALL,)
                directions += [
                    Direction(
                        identity, amplitude.name, "", shapes, scale, record, trials, shaped, least, most
                    )
                    for record in records
                ]
    return directions


def force_directions(problem: Problem) -> list[Direction]:
    """List the generic forces of the kind of plant."""
    return [Direction("", force.name, force.coordinate, {}, 1.0) for force in problem.subject.forces]


def parameters_by_name(simulation: Simulation, identity: str) -> dict[str, FreeParameter]:
    """Return the parameters of a mechanism that `simulation` has, by their names within it."""
    return {one.declared.name: one for one in simulation.parameters if one.mechanism == identity}


def group_by_shapes(directions: Sequence[Direction], chosen: Sequence[int]) -> list[list[int]]:
    """Group the `chosen` indices of directions that act together: one mechanism, one form and one choice of shapes."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for k in chosen:
        direction = directions[k]
        key = (direction.mechanism, direction.form, *direction.shapes.items())
        groups.setdefault(key, []).append(k)
    return list(groups.values())


def _amplitude_scale(parameter: FreeParameter, scales: Scales) -> float:
    with np.errstate(all="ignore"):
        try:
            size = abs(float(parameter.declared.scale(scales)))
        except ZeroDivisionError:
            size = 0.0
    return size if np.isfinite(size) and size > 0.0 else 1.0


def mechanism_sensitivities(
    hypothesis: Hypothesis, directions: list[Direction], problem: Problem, index: int
) -> FloatArray:
    """Differentiate the outputs along the directions of one form of a mechanism; another form may need shorter steps.

    Args:
        hypothesis: Fitted hypothesis without the mechanism.
        directions: Directions of one mechanism and one form.
        problem: Problem whose subject has the steps to try, the largest first.
        index: Index of the record.

    Returns:
        Derivatives (directions, outputs, n); zero where a direction belongs to another record, or no sensible step
        resolves it.
    """
    identity = directions[0].mechanism
    simulation = hypothesis.simulation.extended((identity,))
    record, outputs = problem.records[index], hypothesis.sensitivity.outputs
    slopes = np.zeros((len(directions), len(outputs), record.samples - record.first))
    left = [k for k, direction in enumerate(directions) if direction.record in (ALL, index)]
    for step in problem.subject.difference_steps.sizes if left else ():
        lanes = lanes_along(hypothesis, simulation, [directions[k] for k in left], index, step)
        start = np.asarray(hypothesis.start(index))
        try:
            run = _predict(
                hypothesis.simulation, simulation, record.stimulus, lanes, start, problem.steps_per_period
            )
        except ValueError:
            continue
        moved = np.stack([run.outputs[name][:, record.first :] for name in outputs], axis=1)
        moved = moved[1:] - moved[0]
        checks = check_differences(moved, problem, outputs)
        slopes[[k for k, usable in zip(left, checks.usable, strict=True) if usable]] = (
            moved[checks.usable] / step
        )
        left = [k for k, small in zip(left, checks.small, strict=True) if not small]
        if not left:
            break
    return slopes


# 6 parameters because a prediction takes these
def _predict(
    model: Simulation,
    extended: Simulation,
    stimulus: Stimulus,
    lanes: FloatArray,
    start: FloatArray,
    steps_per_period: float | None,
) -> Prediction:
    """Return what `extended` predicts from `start` (states,): `model` and one mechanism near its neutral value."""
    if isinstance(model, HasDepartures):
        return model.predict_departures(extended, stimulus, lanes, start, steps_per_period)
    return extended.predict(stimulus, lanes, np.tile(start, (len(lanes), 1)), steps_per_period)


def lanes_along(
    hypothesis: Hypothesis, simulation: Simulation, directions: Sequence[Direction], index: int, step: float
) -> FloatArray:
    """Return the parameter values (1 + directions, parameters) at the neutral point and one step along each."""
    identity = directions[0].mechanism
    at = {p.declared.name: k for k, p in enumerate(simulation.parameters) if p.mechanism == identity}
    neutral = [p.value for p in simulation.parameters[len(hypothesis.simulation.parameters) :]]
    lanes = np.tile(np.append(hypothesis.values_of(index), neutral), (1 + len(directions), 1))
    for lane, direction in enumerate(directions, 1):
        for name, value in direction.shapes.items():
            lanes[lane, at[name]] = value
        lanes[lane, at[direction.name]] += step * direction.scale
    for name, value in directions[0].shapes.items():  # or the neutral lane alone may need the finest steps
        lanes[0, at[name]] = value
    return lanes
