"""Directions along the past of motion and drive, and their powers."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import MEMORY, Direction


def lagged_series(simulated: FloatArray, problem: Problem, index: int) -> FloatArray:
    """Return y, y^2, y^3, u and u^3 of a record at lags of `Subject.lag_s`.

    Args:
        simulated: Simulated outputs y (outputs, n), in their units.
        problem: Problem with the drive u and the number of lags.
        index: Index of the record.

    Returns:
        Series (5 lags, outputs, n), each y and u over its size; zero before the record began.
    """
    record = problem.records[index]
    y = simulated - simulated.mean(axis=1, keepdims=True) if problem.subject.size_is_variation else simulated
    y = y / np.sqrt(np.mean(y**2, axis=1, keepdims=True) + 1e-300)
    drive = record.stimulus.inputs.get(problem.subject.drive, np.zeros(record.samples))
    u = drive[record.first :] / (problem.scales.drive or 1.0)
    lag = max(1, round(problem.subject.lag_s(problem.scales) / record.period_s))
    lagged = []
    for k in range(problem.thresholds.residual.memory_lags):
        for series in (y, y**2, y**3, np.broadcast_to(u, y.shape), np.broadcast_to(u**3, y.shape)):
            late = np.zeros_like(y)
            if k * lag < y.shape[1]:
                late[:, k * lag :] = series[:, : y.shape[1] - k * lag]
            lagged.append(late)
    return np.array(lagged)


def memory_directions(count: int) -> list[Direction]:
    """Return the directions of `count` lagged series."""
    return [Direction("", f"past {k}", MEMORY, {}, 1.0) for k in range(count)]
