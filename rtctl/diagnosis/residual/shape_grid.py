"""Where to look for a shape: evenly in its logarithm, and a frequency also where the residual's spectrum peaks."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Mechanism, Parameter
from rtctl.diagnosis.problem.problem import Problem

PEAKS = 3
APART = 0.08
"""Relative distance of two peaks."""


class Shapes(NamedTuple):
    """One choice of all shapes of a mechanism, and from how many the data chose it."""

    values: dict[str, float]
    trials: int


def shape_grid(
    mechanism: Mechanism, problem: Problem, residuals: Sequence[FloatArray], form: str = ""
) -> Iterator[Shapes]:
    """Of one form. Shapes with a default stay there, or where else they are looked for, but for frequencies."""
    axes = {}
    for parameter in mechanism.parameters:
        if parameter.is_shape and parameter.of_form in ("", form):
            axes[parameter.name] = _axis(parameter, problem, residuals)
    for choice in itertools.product(*axes.values()):
        values = {name: value for name, (value, _) in zip(axes, choice, strict=True)}
        yield Shapes(values, max((trials for _, trials in choice), default=1))


def _axis(parameter: Parameter, problem: Problem, residuals: Sequence[FloatArray]) -> list[tuple[float, int]]:
    size = abs(float(parameter.scale(problem.scales))) or 1.0
    low, high = (factor * size for factor in parameter.shape_range)
    if parameter.default is not None and not parameter.searched:
        found = [(value, 1) for value in (parameter.default, *parameter.also)]
    else:
        found = [(value, 1) for value in np.geomspace(low, high, parameter.grid).tolist()]
    if parameter.unit == "Hz":
        found += _peaks(problem, residuals, low, high)
    return found


def _peaks(
    problem: Problem, residuals: Sequence[FloatArray], low: float, high: float
) -> list[tuple[float, int]]:
    """Frequencies [Hz] within the range where the residuals (outputs, n) have most power, and of how many bins."""
    length = 2 * max(residual.shape[1] for residual in residuals)
    power = np.zeros(length // 2 + 1)
    sizes = np.sqrt(sum(np.sum(residual**2, axis=1) for residual in residuals))
    for residual in residuals:
        window = np.hanning(residual.shape[1])
        each = np.abs(np.fft.rfft(residual * window, length, axis=1)) ** 2
        power += (each / np.maximum(sizes, 1e-300)[:, None] ** 2).sum(axis=0)
    frequency = np.fft.rfftfreq(length, problem.scales.period)
    power[(frequency < low) | (frequency > high)] = 0.0
    bins = int(np.count_nonzero(power))
    found: list[tuple[float, int]] = []
    if bins:  # where a step's spectrum would hide it
        found.append((_between(power, int(np.argmax(power * frequency**2))) * float(frequency[1]), bins))
    for _ in range(PEAKS if bins else 0):
        k = int(np.argmax(power))
        if not power[k] > 0.0:
            break
        found.append((_between(power, k) * float(frequency[1]), bins))
        power[np.abs(frequency - frequency[k]) < APART * frequency[k]] = 0.0
    return found


def _between(power: FloatArray, k: int) -> float:
    """Where the peak at bin `k` is, by the parabola of the logarithms of three bins.

    A bin is half a turn over the record: that far off, a strong tone would leave so much that the noise's model, an
    autoregression, took the rest for noise.
    """
    if not 0 < k < len(power) - 1 or not min(power[k - 1], power[k + 1]) > 0.0:
        return float(k)
    left, here, right = np.log(power[k - 1 : k + 2])
    bend = left - 2.0 * here + right
    return float(k + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))
