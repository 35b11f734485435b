"""The missing force along the coordinate where the gap lives, without any formula.

Hat functions of the coordinate act where the drive does and are pushed through the fitted nominal model. Least squares
against its whitened residual, beyond what the nominal parameters follow and with a light penalty on second differences,
gives the force at the knots. A part that a nominal parameter follows (a straight line of z or v) is not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import Projected, RecordRows, project
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

FOLLOWED = ("displacement", "velocity", "drive")
"""Coordinates whose straight line a nominal parameter follows."""
Coordinate = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
"""Function of displacement z, velocity v, drive u and time t, (n,) each, that returns the coordinate (n,)."""
COORDINATES: dict[str, tuple[str, Coordinate]] = {
    "displacement": ("displacement", lambda z, v, u, t: z),
    "velocity": ("velocity", lambda z, v, u, t: v),
    "velocity_sign": ("velocity", lambda z, v, u, t: v),
    "drive": ("drive", lambda z, v, u, t: u),
    "drive_rate": ("drive rate", lambda z, v, u, t: np.gradient(u, t)),
    "time": ("time", lambda z, v, u, t: t),
}
"""Label and function by the name of a coordinate."""


class MissingForce(NamedTuple):
    """A force, as an acceleration, at knots of a coordinate."""

    coordinate: str
    """Label of the coordinate."""
    unit: str
    """Unit of the coordinate."""
    knots: FloatArray
    """(knots,) values of the coordinate, in `unit`."""
    force: FloatArray
    """(knots,) force in `force_unit`."""
    error: FloatArray
    """(knots,) standard errors in `force_unit`."""
    force_unit: str
    share: float
    """Share of the residual's squares beyond the noise that it removes."""


def estimate_missing_force(
    tested: TestedHypothesis, problem: Problem, coordinates: Sequence[str], units: Mapping[str, str]
) -> MissingForce | None:
    """Estimate the missing force along a coordinate.

    Args:
        tested: Fitted nominal model with its tests.
        problem: Problem that it was fitted to.
        coordinates: Coordinates where the gap lives; the first that is a single number is taken.
        units: Units of the outputs and of the drive.

    Returns:
        The force; None where no coordinate is a single number, or the residual is no larger than the noise.
    """
    name = next((one for one in coordinates if one in COORDINATES), None)
    hypothesis, thresholds = tested.hypothesis, problem.thresholds.residual
    gains = [p.value for p in hypothesis.simulation.parameters if p.name == "drive_gain"]
    if name is None or not gains:
        return None
    label, coordinate = COORDINATES[name]
    visited = np.concatenate(
        [coordinate(*_motion(hypothesis, problem, k)) for k in range(len(problem.records))]
    )
    low, high = np.quantile(visited, thresholds.force_range)
    dense = thresholds.force_knot_power if name == "velocity_sign" else 1.0
    knots = _place_knots(low, high, thresholds.force_knots, dense)
    rows = [
        RecordRows(residual=line.residual, shared=line.shared, local=line.local,
             directions=_hat_sensitivities(hypothesis, problem, k, coordinate, knots),
             period_s=problem.records[k].period_s)
        for k, line in enumerate(hypothesis.linearise(problem))
    ]  # fmt: skip
    projected = project(rows, tested.noise, thresholds)
    solution = _solve(projected, rows[0].shared.shape[0], thresholds.force_smoothing)
    if solution is None:
        return None
    keep = _line_remover(knots, visited) if label in FOLLOWED else np.eye(len(knots))
    scale, z = abs(gains[0]) * problem.scales.drive, units["displacement"]
    force = scale * keep @ solution.weights
    error = scale * np.sqrt(np.maximum(np.diag(keep @ solution.covariance @ keep.T), 0.0))
    return MissingForce(label, _unit_of(label, units), knots, force, error, f"{z}/s^2", solution.share)


def _place_knots(low: float, high: float, count: int, power: float) -> FloatArray:
    """Return knots from `low` to `high`: evenly for a power of 1, densest about 0 for a larger one.

    A force that jumps where the motion turns would be a slope between even knots.
    """
    if power == 1.0 or not low < 0.0 < high:
        return np.linspace(low, high, count)
    at = np.linspace(-1.0, 1.0, count)
    return np.asarray(np.where(at < 0.0, -low, high) * np.sign(at) * np.abs(at) ** power)


def _unit_of(label: str, units: Mapping[str, str]) -> str:
    z = units["displacement"]
    by_label = {
        "displacement": z,
        "velocity": f"{z}/s",
        "drive": units["drive"],
        "drive rate": f"{units['drive']}/s",
    }
    return by_label.get(label, "s")


class _Solution(NamedTuple):
    weights: FloatArray
    """(knots,) force over that of the drive."""
    covariance: FloatArray
    share: float


def _solve(projected: Projected, shared: int, smoothing: float) -> _Solution | None:
    """Return the weights of the hats in the residual; None where nothing is left beyond the noise."""
    gram, right = projected.left[1:, 1:], -projected.left[1:, 0]
    bend = np.diff(np.eye(len(gram)), 2, axis=0)
    inverse = np.linalg.pinv(gram + smoothing * bend.T @ bend, rcond=1e-6, hermitian=True)
    size, solved = projected.scale[1 + shared :], inverse @ right
    beyond_noise = projected.residual - (projected.samples - projected.rank)
    if not beyond_noise > 0.0:
        return None
    removed = projected.scale[0] ** 2 * float(2.0 * right @ solved - solved @ gram @ solved)
    covariance = inverse @ gram @ inverse / size[:, None] / size
    share = float(np.clip(removed / beyond_noise, 0.0, 1.0))
    return _Solution(solved * projected.scale[0] / size, covariance, share)


def _line_remover(knots: FloatArray, visited: FloatArray) -> FloatArray:
    """Return the matrix (knots, knots) that takes off the straight line through 0 that fits best where the motion was.

    A nominal parameter follows that line.
    """
    between = 0.5 * (knots[1:] + knots[:-1])
    weight = np.histogram(visited, np.concatenate(([-np.inf], between, [np.inf])))[0] + 1.0
    weighted = knots * weight
    remover: FloatArray = np.eye(len(knots)) - np.outer(knots, weighted) / float(knots @ weighted)
    return remover


def _motion(
    hypothesis: Hypothesis, problem: Problem, index: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return displacement, velocity, drive and time [s] of a simulated record, (n,) each."""
    record = problem.records[index]
    start = np.atleast_2d(hypothesis.start(index))
    run = hypothesis.simulation.predict(record.stimulus, hypothesis.values, start, problem.steps_per_period)
    time = record.period_s * np.arange(record.samples, dtype=np.float64)
    return run.outputs["displacement"][0], run.outputs["velocity"][0], record.stimulus.inputs["drive"], time


def _hat_sensitivities(
    hypothesis: Hypothesis, problem: Problem, index: int, coordinate: Coordinate, knots: FloatArray
) -> FloatArray:
    """Return the derivatives (knots, outputs, n) of the outputs by each hat, as strong as the drive."""
    record = problem.records[index]
    motion = _motion(hypothesis, problem, index)
    along, u = coordinate(*motion), motion[2]
    start = np.atleast_2d(hypothesis.start(index))
    scale, step = problem.scales.drive or 1.0, problem.thresholds.residual.force_step

    def simulate(drive: FloatArray) -> FloatArray:
        stimulus = Stimulus(
            inputs={"drive": drive}, holds=record.stimulus.holds, period_s=record.period_s,
            initial=record.stimulus.initial, peak=record.stimulus.peak, swing=record.stimulus.swing,
            after_jumps=record.stimulus.after_jumps,
        )  # fmt: skip
        run = hypothesis.simulation.predict(stimulus, hypothesis.values, start, problem.steps_per_period)
        return np.stack([run.outputs[name][0, record.first :] for name in hypothesis.sensitivity.outputs])

    base = simulate(u)
    hats = [np.interp(along, knots, row) for row in np.eye(len(knots))]
    slopes = np.array([(simulate(u + step * scale * hat) - base) / step for hat in hats])
    derivatives: FloatArray = np.nan_to_num(slopes)
    return derivatives
