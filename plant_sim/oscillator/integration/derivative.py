"""Time derivative of a sampled course by differences of the fourth order."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

WIDTH = 5
"""Samples of a difference; its error is of the order of the step to the power of four."""


def differentiate(course: FloatArray, corners: int, step_s: float, *, before: bool = False) -> FloatArray:
    """Return the derivative (lanes, n) of `course` (lanes, n).

    Args:
        course: Courses of several lanes, `WIDTH` samples or more.
        corners: Samples from one instant to the next at which the course may have a corner, `WIDTH` - 1 or more.
        step_s: Time between samples of the course [s].
        before: Whether to take the derivative just before each corner: differences do not reach across it then, but
            for the first. Otherwise samples on both sides are taken, as far as there are any.
    """
    at = np.arange(course.shape[1])
    first = at - WIDTH // 2
    if before:
        last_corner = np.maximum(at - 1, 0) // corners * corners
        first = np.clip(first, last_corner, last_corner + corners - WIDTH + 1)
    first = np.clip(first, 0, course.shape[1] - WIDTH)
    weights = np.array([_weights(place) for place in range(WIDTH)])[at - first]
    derivative = np.zeros_like(course)
    with np.errstate(invalid="ignore", over="ignore"):  # of a course that diverged
        for k in range(WIDTH):
            derivative += weights[:, k] * course[:, first + k]
    return derivative / step_s


def _weights(place: int) -> FloatArray:
    """Return the weights (WIDTH,) of the derivative at sample `place` of a difference, at steps of 1."""
    powers = np.vander(np.arange(WIDTH) - float(place), increasing=True)
    return np.asarray(np.linalg.inv(powers)[1])
