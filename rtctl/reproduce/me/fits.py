"""Records of the study's resonator under one tone, and the three ways in which they are fitted."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.identification.fit import FitError
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.annealing import AnnealingOptions, AnnealingResult, anneal
from rtctl.identification.oscillator.start_values import generate_starts
from rtctl.identification.oscillator.tone_cost import (
    Objective,
    ToneRecord,
    compute_cost,
    compute_scores,
    compute_sizes,
)
from rtctl.identification.simulation_error.output_error import FitOptions, fit_output_error
from rtctl.reproduce.me import device

FIELD = 0.28
"""Field [mT] of the paper's training data."""
FREQUENCY_HZ = 7498.0
"""Frequency setting of the generator [Hz]: the resonance at that field."""
CLOCK_ERROR = 3e-6
"""Relative clock error of the generator against the recorder: the paper's "slight discrepancy" of the frequency."""
CLOCK_RANGE = 1e-5
STIFFNESS_RANGE = 0.02
FACTOR_RANGE = (0.5, 1.5)
"""Range of damping and force relative to the expected values."""
OPTIONS = FitOptions(free_start=False, threads=1, iterations=40)
CUBIC_RANGE = 3e7
"""Range of the cubic stiffness [1/(um^2 s^2)], to both sides: 37 Hz at 1 um."""


class Box(NamedTuple):
    """Ranges of the coefficients (5,), as `tone_cost.NAMES`."""

    low: FloatArray
    high: FloatArray


class Found(NamedTuple):
    """Result of a fit."""

    values: FloatArray
    """Coefficients (5,)."""
    seconds: float
    """Processor time [s], on one thread."""
    annealed: AnnealingResult | None = None


def driven(duration_s: float, field_mT: float = FIELD, frequency_hz: float = FREQUENCY_HZ) -> Stimulus:
    """Return the tone as the recorder sees it."""
    return device.tone(field_mT, frequency_hz * (1.0 + CLOCK_ERROR), duration_s)


def tone_record(displacement: FloatArray, first: int = 0) -> ToneRecord:
    """Return a record from the tone's start; samples before `first` are not scored."""
    return ToneRecord(displacement=displacement, period_s=1.0 / device.SAMPLE_RATE_HZ, first=first)


def truth(field_mT: float = FIELD) -> FloatArray:
    """Return the coefficients (5,) of the device: the force at small fields, without its quintic spring."""
    rate = 2.0 * math.pi * FREQUENCY_HZ * (1.0 + CLOCK_ERROR)
    return np.array([device.DAMPING, device.STIFFNESS, device.CUBIC, device.GAIN * field_mT, rate])


def box(field_mT: float = FIELD) -> Box:
    """Return the ranges about a designer's expectation of such a device."""
    middle = truth(field_mT)
    middle[2], middle[4] = 0.0, 2.0 * math.pi * FREQUENCY_HZ
    low, high = FACTOR_RANGE
    spread = np.array(
        [0.0, STIFFNESS_RANGE * device.STIFFNESS, CUBIC_RANGE, 0.0, CLOCK_RANGE * float(middle[4])]
    )
    down, up = np.array([low, 1.0, 1.0, low, 1.0]), np.array([high, 1.0, 1.0, high, 1.0])
    return Box(middle * down - spread, middle * up + spread)


def start_in(ranges: Box, seed: int) -> FloatArray:
    """Draw a start (5,) in the inner half of the box; the spring is linear, the frequency as set."""
    share = np.random.default_rng(seed).uniform(0.25, 0.75, 5)
    share[2] = share[4] = 0.5
    return np.asarray(ranges.low + share * (ranges.high - ranges.low))


def annealing(
    record: ToneRecord,
    objective: Objective,
    start: FloatArray,
    options: AnnealingOptions,
    ranges: Box | None = None,
) -> Found:
    """Fit by Algorithm 1 as it is meant."""
    low, high = ranges or box()
    begun = time.process_time()
    found = anneal(lambda sets: compute_cost(record, objective, sets), start, low, high, options)
    return Found(found.values, time.process_time() - begun, found)


def sized(record: ToneRecord, values: FloatArray) -> FloatArray:
    """Scale `values` to the record's amplitude, to which correlation and peak index are insensitive.

    z -> s z with F -> s F and b -> b / s^2 is the same motion on another scale: an exact symmetry of the equation.
    """
    measured = float(np.sqrt(np.mean(record.displacement[record.first :] ** 2)))
    correlation = float(compute_scores(record, values[None, :]).correlation[0])
    factor = max(correlation, 0.0) * measured / float(compute_sizes(record, values[None, :])[0])
    return values * np.array([1.0, 1.0, factor**-2, factor, 1.0]) if factor > 0.0 else values


def least_squares(
    stimulus: Stimulus,
    displacement: FloatArray,
    start: FloatArray | None,
    first: int = 0,
    field_mT: float = FIELD,
) -> Found | None:
    """Fit by output error within the box from `start` (5,), or from the weak form's start values; None: it diverged.

    The frequency is the record's own: it comes with the measured drive.
    """
    begun = time.process_time()
    simulation = _within(device.simulation(device.model(nominal=True)), box(field_mT), field_mT)
    peak = {"displacement": float(np.abs(displacement).max())}
    whole = replace(stimulus, peak=peak, initial={"displacement": 0.0, "velocity": 0.0})
    record = FitRecord(name="tone", stimulus=whole, measured={"displacement": displacement}, first=first)
    if start is None:
        starts = generate_starts(simulation, [record], 1, 0, trust_own=False).values
    else:
        starts = [np.append(start[:3], start[3] / field_mT)]
    try:
        fit = fit_output_error(simulation, [record], OPTIONS, starts=starts)
    except FitError:
        return None
    values = np.append(fit.values[:3], (fit.values[3] * field_mT, truth()[4]))
    return Found(values, time.process_time() - begun)


def _within(simulation: Simulation, ranges: Box, field_mT: float) -> Simulation:
    """Bound the simulation's parameters as the annealing's."""
    scale = np.array([1.0, 1.0, 1.0, field_mT])
    low, high = (side[:4] / scale for side in ranges)
    bounded = tuple(
        one._replace(low=float(a), high=float(b))
        for one, a, b in zip(simulation.parameters, low, high, strict=True)
    )
    found: Simulation = replace(cast(Any, simulation), parameters=bounded)
    return found
