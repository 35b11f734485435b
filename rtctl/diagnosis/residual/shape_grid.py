"""Values at which the shapes of a mechanism are tried: evenly in their logarithm, and at peaks of the spectrum."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Mechanism, Parameter
from rtctl.diagnosis.problem.bounds import lowest_frequency, places_of_motion
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.tones import find_tones, interpolate_peak
from rtctl.identification.noise.residual_noise import group_by_period


class Shapes(NamedTuple):
    """One choice of all shapes of a mechanism."""

    values: dict[str, float]
    """Shapes by name, in their units."""
    trials: int
    """Number of choices among which the data chose this one; 1: none."""


def shape_grid(
    mechanism: Mechanism, problem: Problem, residuals: Sequence[FloatArray], form: str = ""
) -> Iterator[Shapes]:
    """Yield the choices of the shapes of one form of a mechanism.

    A shape with a default stays there, unless the mechanism declares other values or that it is searched; one with a
    simplest value by which the law has no derivative is tried there and over its range. A frequency is also tried where
    the spectrum of the residuals peaks.

    Args:
        mechanism: Mechanism of the catalogue.
        problem: Problem with the scales of the shapes.
        residuals: Residual (outputs, n) of each record.
        form: Form of the mechanism.
    """
    axes = {}
    for parameter in mechanism.parameters:
        if parameter.is_shape and parameter.of_form in ("", form):
            axes[parameter.name] = _axis(parameter, problem, residuals, form)
    for choice in itertools.product(*axes.values()):
        values = {name: value for name, (value, _) in zip(axes, choice, strict=True)}
        yield Shapes(values, max((trials for _, trials in choice), default=1))


def _axis(
    parameter: Parameter, problem: Problem, residuals: Sequence[FloatArray], form: str
) -> list[tuple[float, int]]:
    """Return the values of one shape, in its unit, each with its number of trials."""
    if parameter.quantiles:
        return [(value, 1) for value in places_of_motion(parameter, problem, form)]
    size = abs(float(parameter.scale(problem.scales))) or 1.0
    low, high = (factor * size for factor in parameter.shape_range)
    lowest = lowest_frequency(parameter, problem)
    if parameter.least_periods and parameter.default is None:
        return _lines(problem, residuals, max(low, lowest), high)
    if parameter.redundant and parameter.default is None:
        values = [(size, 1)]
    elif (
        parameter.default is not None and not parameter.searched and not parameter.stays_at(parameter.default)
    ):
        values = [(value, 1) for value in (parameter.default, *parameter.also)]
    else:
        values = [(value, 1) for value in np.geomspace(low, high, parameter.grid).tolist()]
        values += [] if parameter.simplest is None else [(parameter.simplest, 1)]
    if parameter.unit == "Hz":
        values += _peaks(problem, residuals, low, high)
    return [one for one in values if one[0] >= lowest] if parameter.least_periods else values


def _lines(
    problem: Problem, residuals: Sequence[FloatArray], low: float, high: float
) -> list[tuple[float, int]]:
    """Return the frequencies [Hz] between `low` and `high` of lines that stand in every record, and the bins there.

    A tone with a phase of its own in each record takes up a part of whatever is missing near its frequency; only as a
    line it is a tone.
    """
    periods_s = [record.period_s for record in problem.records]
    group = max(group_by_period(periods_s), key=len)
    found = []
    for output in range(residuals[0].shape[0]):
        errors = [residuals[k][output] for k in group]
        found += find_tones(errors, problem.thresholds.residual)
    length, period_s = min(residuals[k].shape[1] for k in group), periods_s[group[0]]
    bins = max(1, int((high - low) * length * period_s))
    lines = [tone.frequency / period_s for tone in sorted(found, key=lambda one: -one.amplitude)]
    return [(line, bins) for line in lines if low <= line <= high]


def _peaks(
    problem: Problem, residuals: Sequence[FloatArray], low: float, high: float
) -> list[tuple[float, int]]:
    """Return the frequencies [Hz] between `low` and `high` where the residuals have most power, and the bins there."""
    thresholds = problem.thresholds.residual
    power = _power(residuals)
    frequency = np.fft.rfftfreq(2 * (len(power) - 1), problem.scales.period)
    power[(frequency < low) | (frequency > high)] = 0.0
    bins = int(np.count_nonzero(power))
    peaks: list[tuple[float, int]] = []
    if bins:  # where a step's spectrum would hide it
        steepest = int(np.argmax(power * frequency**2))
        peaks.append((interpolate_peak(power, steepest) * float(frequency[1]), bins))
    for _ in range(thresholds.spectrum_peaks if bins else 0):
        k = int(np.argmax(power))
        if not power[k] > 0.0:
            break
        peaks.append((interpolate_peak(power, k) * float(frequency[1]), bins))
        power[np.abs(frequency - frequency[k]) < thresholds.spectrum_peak_distance * frequency[k]] = 0.0
    return peaks


def _power(residuals: Sequence[FloatArray]) -> FloatArray:
    """Return the power spectrum of all records and outputs together, each output over its size."""
    length = 2 * max(residual.shape[1] for residual in residuals)
    power = np.zeros(length // 2 + 1)
    sizes = np.sqrt(sum(np.sum(residual**2, axis=1) for residual in residuals))
    for residual in residuals:
        window = np.hanning(residual.shape[1])
        spectrum = np.abs(np.fft.rfft(residual * window, length, axis=1)) ** 2
        power += (spectrum / np.maximum(sizes, 1e-300)[:, None] ** 2).sum(axis=0)
    return power
