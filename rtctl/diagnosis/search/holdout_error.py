"""Free-run error on records that took no part in a fit, and the gain of an extension there with its interval.

The interval of the ratio comes from a bootstrap of both squared errors together, by blocks that do not overlap, since
errors are coloured (E. Carlstein, Annals of Statistics 14 (1986) 1171).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Prediction, Simulation
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.thresholds import SearchThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel
from rtctl.identification.simulation_error.record_unknowns import fit_record_unknowns

DEFAULTS = SearchThresholds()


class Gain(NamedTuple):
    """Errors of one output over the test records (RMS), in its unit."""

    output: str
    unit: str
    before: float
    """Error of the nominal model."""
    after: float
    """Error of the extended model."""
    noise_floor: float
    """RMS of the noise."""
    ratio: float
    """`before` over `after`."""
    ratio_low: float
    """Lower end of its 95 % interval."""
    ratio_high: float
    """Upper end of its 95 % interval."""

    @property
    def in_words(self) -> str:
        """How many times less, or more, the error is, with its 95 % interval."""
        if self.ratio >= 1.0:
            return f"{self.ratio:.3g} times less, 95 % between {self.ratio_low:.3g} and {self.ratio_high:.3g}"
        more, low, high = (
            1.0 / one if one else math.inf for one in (self.ratio, self.ratio_high, self.ratio_low)
        )
        return f"{more:.3g} times more, 95 % between {low:.3g} and {high:.3g}"

    def falls_to(self, least: float, allowed: float = 0.0) -> bool:
        """Return whether the error beyond the noise falls to less than one over `least`.

        Args:
            least: ratio of errors, before over after.
            allowed: mean square of what the model may be off by; the noise itself may have taken it up.
        """
        floor = max(self.noise_floor**2, allowed)
        before, after = (max(error**2 - floor, 0.0) for error in (self.before, self.after))
        return after < before / least**2


def certainly_falls(gains: Iterable[Gain], least: float = 1.0) -> bool:
    """Return whether the error of one output certainly falls by `least` times, and that of none certainly rises."""
    gains = tuple(gains)
    return any(one.ratio_low > least for one in gains) and all(one.ratio_high >= 1.0 for one in gains)


class ScoredOutput(NamedTuple):
    """Output of which errors on test records are compared."""

    name: str
    unit: str
    noise_rms: float
    """RMS of its noise, in `unit`."""
    noise: NoiseModel | None = None
    """Noise in which errors are whitened before they are compared; None: as they are."""


def measure_gain(
    before: Simulation,
    after: Simulation,
    records: Sequence[FitRecord],
    output: ScoredOutput,
    rate: float,
    limits: SearchThresholds = DEFAULTS,
) -> Gain | None:
    """Measure by how much the error of free runs over test records falls.

    Args:
        before: Nominal model.
        after: Extended model.
        records: Test records.
        output: Output that is compared.
        rate: Angular frequency of the motion [1/s], which sets the length of the bootstrap's blocks.
        limits: Thresholds of the search.

    Returns:
        The gain; None without records.
    """
    if not records:
        return None

    def errors(model: Simulation) -> list[FloatArray]:
        found = [compute_free_run_error(model, record, output.name, limits=limits) for record in records]
        if output.noise is None:
            return found
        return [whiten_error(one, output.noise, record) for one, record in zip(found, records, strict=True)]

    return compare_errors(errors(before), errors(after), records, output, rate, limits)


# 6 parameters because a gain is that of two models, on some records, of one output
def compare_errors(
    old: Sequence[FloatArray],
    new: Sequence[FloatArray],
    records: Sequence[FitRecord],
    output: ScoredOutput,
    rate: float,
    limits: SearchThresholds = DEFAULTS,
) -> Gain:
    """Return the gain of `new` errors over `old` ones, (n,) each, one for each of the records."""
    length = max(8, round(limits.bootstrap_block_periods * 2.0 * np.pi / rate / records[0].period_s))
    length = max(1, min(length, sum(len(one) for one in old) // limits.bootstrap_least_blocks))
    low, high = _bootstrap_interval(old, new, length, limits.bootstrap_resamples)
    first, second = _rms(old), _rms(new)
    ratio = first / second if second > 0.0 else math.inf
    return Gain(output.name, output.unit, first, second, output.noise_rms, ratio, low, high)


def measure_gains(
    before: Hypothesis,
    after: TestedHypothesis,
    problem: Problem,
    tests: Sequence[FitRecord],
    *,
    whitened: bool = False,
) -> list[Gain]:
    """Return the gain of each output on the test records that have it.

    Args:
        before: Fitted set.
        after: Another one; the noise is that of its tests.
        problem: Records that were fitted.
        tests: Records that took no part in a fit.
        whitened: Whether errors are compared in units of the noise.
    """
    gains = []
    for name, noise in zip(after.hypothesis.sensitivity.outputs, after.noise, strict=True):
        seen = [record for record in tests if name in record.measured]
        output = ScoredOutput(name, "", float(np.sqrt(noise.mean_square)))
        if whitened:
            output = ScoredOutput(name, "", 1.0, noise)
        gain = measure_gain(
            before.simulation, after.hypothesis.simulation, seen, output, problem.scales.rate,
            problem.thresholds.search,
        )  # fmt: skip
        gains += [] if gain is None else [gain]
    return gains


def compute_free_run_error(
    simulation: Simulation,
    record: FitRecord,
    output: str,
    within: float = 1.0,
    limits: SearchThresholds = DEFAULTS,
) -> FloatArray:
    """Return simulated minus measured (n,) over the scored samples; infinite if the run diverges.

    Args:
        simulation: Model at its fitted parameters.
        record: Test record.
        output: Name of the output.
        within: Initial share of the scored samples to which the record's own unknowns are fitted.
        limits: Thresholds of the search.
    """
    run = simulate_free_run(simulation, record, output, within, limits)
    if run.diverged_at[0] >= 0:
        return np.full(record.samples - record.first, np.inf)
    error: FloatArray = (run.outputs[output][0] - record.measured[output])[record.first :]
    return error


def whiten_error(error: FloatArray, noise: NoiseModel, record: FitRecord) -> FloatArray:
    """Return an error (n,) in units of the noise, white where it is nothing else; infinite if the run diverges."""
    if not np.isfinite(error).all():
        return error
    white: FloatArray = noise.for_period(record.period_s).whiten(error)
    return white


def simulate_free_run(
    simulation: Simulation,
    record: FitRecord,
    output: str,
    within: float = 1.0,
    limits: SearchThresholds = DEFAULTS,
) -> Prediction:
    """Simulate a test record from its fitted initial state.

    The record's own unknowns are fitted first: its initial state, since the first sample is noisy and a lightly damped
    device rings with that noise for a long time, and parameters that each record has for itself, as the phase of a hum.
    They stay as they are where no fit succeeds.

    Args:
        simulation: Model at its fitted parameters.
        record: Test record.
        output: Name of the output that the unknowns are fitted to.
        within: Initial share of the scored samples that is used for this.
        limits: Thresholds of the search.

    Returns:
        A prediction of one lane; of NaN where no sensible step resolves the model at the record's amplitude.
    """
    values = np.array([parameter.value for parameter in simulation.parameters])
    own = [k for k, one in enumerate(simulation.parameters) if one.declared.per_record and not one.fixed]
    start = None
    if simulation.state or own:
        found = fit_record_unknowns(
            simulation, record, _cut_record(record, output, within),
            iterations=limits.free_run_iterations, tolerance=limits.free_run_tolerance,
        )  # fmt: skip
        start, values[own] = np.atleast_2d(found.start), found.own
    try:
        return simulation.predict(record.stimulus, values, start)
    except ValueError:  # no sensible step resolves the model at this record's amplitude
        nothing = {name: np.full((1, record.samples), np.nan) for name in simulation.outputs}
        return Prediction(nothing, np.zeros(1, dtype=np.int64))


def _cut_record(record: FitRecord, output: str, within: float) -> FitRecord:
    """Return the initial share `within` of the scored samples, of one output."""
    alone = replace(record, measured={output: record.measured[output]})
    return alone.truncate(record.first + round(within * (record.samples - record.first)))


def _rms(errors: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _bootstrap_interval(
    old: Sequence[FloatArray], new: Sequence[FloatArray], length: int, resamples: int
) -> tuple[float, float]:
    """Return the 95 % interval of the ratio of RMS errors, from blocks of `length` samples."""
    squares = []
    for first, second in zip(old, new, strict=True):
        count = max(1, len(first) // length)
        for part in zip(np.array_split(first, count), np.array_split(second, count), strict=True):
            squares.append([float(np.sum(piece**2)) for piece in part])
    table = np.array(squares)
    if not np.isfinite(table).all():
        return 0.0, math.inf
    draws = np.random.default_rng(0).integers(0, len(table), (resamples, len(table)))
    sums = table[draws].sum(axis=1)
    ratios = np.sqrt(sums[:, 0] / np.maximum(sums[:, 1], 1e-300))
    low, high = np.percentile(ratios, [2.5, 97.5])
    return float(low), float(high)
