"""The shape of the force that is missing, along the coordinate where the gap lives, without any formula.

Hat functions of the coordinate act where the drive does and are pushed through the fitted nominal model; least squares
against its whitened residual, less what the nominal parameters follow, with a light penalty on kinks. A part that a
nominal parameter could follow (a straight line of z or of v) is not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import Projected, Rows, project
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

KNOTS = 13
STEP = 1e-4
KINKS = 1e-3
"""Weight of the squared second differences beside the data."""
FOLLOWED = ("displacement", "velocity", "drive")
"""Coordinates whose straight line is a nominal parameter."""
Coordinate = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
COORDINATES: dict[str, tuple[str, Coordinate]] = {
    "displacement": ("displacement", lambda z, v, u, t: z),
    "velocity": ("velocity", lambda z, v, u, t: v),
    "velocity_sign": ("velocity", lambda z, v, u, t: v),
    "drive": ("drive", lambda z, v, u, t: u),
    "drive_rate": ("drive rate", lambda z, v, u, t: np.gradient(u, t)),
    "time": ("time", lambda z, v, u, t: t),
}


class Shape(NamedTuple):
    """A force, in units of the acceleration, at knots of a coordinate in its unit, with standard errors."""

    coordinate: str
    unit: str
    knots: FloatArray
    force: FloatArray
    error: FloatArray
    force_unit: str
    share: float
    """Of the residual's squares beyond the noise that it removes."""


def residual_shape(
    examined: TestedHypothesis, problem: Problem, coordinates: Sequence[str], units: Mapping[str, str]
) -> Shape | None:
    """Along the first of `coordinates` that is one number; None: none is, or it is invisible."""
    name = next((one for one in coordinates if one in COORDINATES), None)
    hypothesis = examined.hypothesis
    gains = [p.value for p in hypothesis.simulation.parameters if p.name == "drive_gain"]
    if name is None or not gains:
        return None
    label, coordinate = COORDINATES[name]
    visited = np.concatenate(
        [coordinate(*_motion(hypothesis, problem, k)) for k in range(len(problem.records))]
    )
    low, high = np.quantile(visited, [0.002, 0.998])
    knots = np.linspace(low, high, KNOTS)
    rows = [
        Rows(residual=line.residual, shared=line.shared, local=line.local,
             directions=_slopes(hypothesis, problem, k, coordinate, knots), period_s=problem.records[k].period_s)
        for k, line in enumerate(hypothesis.linearise(problem))
    ]  # fmt: skip
    found = _least_squares(project(rows, examined.noise), rows[0].shared.shape[0])
    if found is None:
        return None
    keep = _without_line(knots, visited) if label in FOLLOWED else np.eye(KNOTS)
    scale, z = abs(gains[0]) * problem.scales.drive, units["displacement"]
    unit = {
        "displacement": z,
        "velocity": f"{z}/s",
        "drive": units["drive"],
        "drive rate": f"{units['drive']}/s",
    }
    force = scale * keep @ found.weights
    error = scale * np.sqrt(np.maximum(np.diag(keep @ found.covariance @ keep.T), 0.0))
    return Shape(label, unit.get(label, "s"), knots, force, error, f"{z}/s^2", found.share)


class _Found(NamedTuple):
    weights: FloatArray
    covariance: FloatArray
    share: float


def _least_squares(projected: Projected, shared: int) -> _Found | None:
    """Weights of the hats against the residual, in units of the drive; None: nothing is left beyond the noise."""
    gram, right = projected.left[1:, 1:], -projected.left[1:, 0]
    bend = np.diff(np.eye(len(gram)), 2, axis=0)
    inverse = np.linalg.pinv(gram + KINKS * bend.T @ bend, rcond=1e-6, hermitian=True)
    size, solved = projected.scale[1 + shared :], inverse @ right
    beyond = projected.residual - (projected.samples - projected.rank)
    if not beyond > 0.0:
        return None
    removed = projected.scale[0] ** 2 * float(2.0 * right @ solved - solved @ gram @ solved)
    covariance = inverse @ gram @ inverse / size[:, None] / size
    return _Found(solved * projected.scale[0] / size, covariance, float(np.clip(removed / beyond, 0.0, 1.0)))


def _without_line(knots: FloatArray, visited: FloatArray) -> FloatArray:
    """(knots, knots) takes off the straight line that fits best where the motion was: a nominal parameter is that."""
    weight = np.histogram(visited, np.append(knots - 0.5 * np.diff(knots)[0], np.inf))[0] + 1.0
    weighted = knots * weight
    found: FloatArray = np.eye(len(knots)) - np.outer(knots, weighted) / float(knots @ weighted)
    return found


def _motion(
    hypothesis: Hypothesis, problem: Problem, index: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    record = problem.records[index]
    start = np.atleast_2d(hypothesis.start(index))
    run = hypothesis.simulation.predict(record.stimulus, hypothesis.values, start, problem.steps_per_period)
    time = record.period_s * np.arange(record.samples, dtype=np.float64)
    return run.outputs["displacement"][0], run.outputs["velocity"][0], record.stimulus.inputs["drive"], time


def _slopes(
    hypothesis: Hypothesis, problem: Problem, index: int, coordinate: Coordinate, knots: FloatArray
) -> FloatArray:
    """(knots, outputs, n): what each hat, as strong as the drive, does to the outputs."""
    record = problem.records[index]
    motion = _motion(hypothesis, problem, index)
    along, u = coordinate(*motion), motion[2]
    start = np.atleast_2d(hypothesis.start(index))
    scale = problem.scales.drive or 1.0

    def run(drive: FloatArray) -> FloatArray:
        stimulus = Stimulus(
            inputs={"drive": drive}, holds=record.stimulus.holds, period_s=record.period_s,
            initial=record.stimulus.initial, peak=record.stimulus.peak, swing=record.stimulus.swing,
        )  # fmt: skip
        found = hypothesis.simulation.predict(stimulus, hypothesis.values, start, problem.steps_per_period)
        return np.stack([found.outputs[name][0, record.first :] for name in hypothesis.sensitivity.outputs])

    base = run(u)
    hats = [np.interp(along, knots, row) for row in np.eye(len(knots))]
    made: FloatArray = np.nan_to_num(np.array([(run(u + STEP * scale * hat) - base) / STEP for hat in hats]))
    return made
