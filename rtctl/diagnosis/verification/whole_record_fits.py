"""Fits of whole records, by which the gain and the extended model are computed, and the gain itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.parameter_estimates import estimates_by_mechanism
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.holdout_error import Gain, ScoredOutput, measure_gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.identification.fit_record import FitRecord


class Fits(NamedTuple):
    """The re-fitted nominal model and the extended one; the same one twice where no cause is named."""

    before: TestedHypothesis
    after: TestedHypothesis


class HoldoutData(NamedTuple):
    """What a free-run error on test records is computed with."""

    tests: Sequence[FitRecord]
    units: Mapping[str, str]
    """Unit by output."""
    noise: TestedHypothesis
    """Fit whose noise model gives the noise floor."""
    rate: float
    """Dominant angular frequency of the motion [1/s]."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Return the outputs that all test records have."""
        outputs = self.noise.hypothesis.sensitivity.outputs
        return tuple(name for name in outputs if all(name in test.measured for test in self.tests))

    def gain_of(self, fits: Fits, output: str) -> Gain | None:
        """Return the errors of `output` before and after; None without test records."""
        unit, noise_rms = self.units.get(output, ""), noise_rms_of(self.noise, output)
        return self._measure(fits, ScoredOutput(output, unit, noise_rms))

    def whitened_gain_of(self, fits: Fits, output: str) -> Gain | None:
        """Return the errors of `output` before and after in units of the noise; None without test records."""
        outputs = self.noise.hypothesis.sensitivity.outputs
        return self._measure(fits, ScoredOutput(output, "", 1.0, self.noise.noise[outputs.index(output)]))

    def _measure(self, fits: Fits, output: ScoredOutput) -> Gain | None:
        before, after = fits.before.hypothesis.simulation, fits.after.hypothesis.simulation
        return measure_gain(before, after, self.tests, output, self.rate)


def fit_whole_records(first: NominalFit, problem: Problem, search: SearchResult) -> Fits | None:
    """Fit the set that was chosen within parts of records to the free runs of whole records.

    Args:
        first: The re-fitted nominal model, and the parts of the records that the search used.
        problem: These parts.
        search: What was found.

    Returns:
        None where the search used whole records, where the set does not fit them or less well than the nominal model,
        or where the parts are initial ones and what follows is not followed as well.
    """
    if first.whole is None or first.uncut:
        return None
    whole, nominal = first.whole
    chosen = search.chosen.hypothesis
    refitted = fit_hypothesis(
        whole, chosen.simulation, chosen.mechanisms, fixed_parameters=chosen.fixed_parameters
    )
    if refitted is None or refitted.cost > nominal.cost:
        return None
    most = problem.thresholds.verification.whole_cost_ratio * chosen.cost / problem.samples
    if first.parted and refitted.cost / whole.samples > most:
        return None
    after = run_residual_tests(refitted, whole, ())
    is_nominal = chosen is search.nominal.hypothesis
    return Fits(after if is_nominal else run_residual_tests(nominal, whole, ()), after)


def extend_model(
    problem: Problem,
    model: Any,
    after: TestedHypothesis,
    simulation: Simulation | None = None,
    estimates: Mapping[str, Mapping[str, Estimate]] | None = None,
) -> Any:
    """Return the model of the file with the values, mechanisms and initial states of a fit.

    Args:
        problem: Records that were fitted.
        model: The file's model.
        after: The fit.
        simulation: Its simulation with further mechanisms; None: as it is.
        estimates: Parameters of these further mechanisms, by mechanism and name.
    """
    subject = problem.subject
    known = {**estimates_by_mechanism(after), **(estimates or {})}
    extended = subject.extended_model(model, simulation or after.hypothesis.simulation, known)
    if subject.with_starts is None:
        return extended
    starts = [after.hypothesis.start(index) for index in range(len(problem.records))]
    return subject.with_starts(extended, after.hypothesis.simulation.state, problem.records, starts)


def noise_rms_of(tested: TestedHypothesis, output: str) -> float:
    """Return the RMS of the noise of an output by its model, in the output's unit; nan without such an output."""
    outputs = tested.hypothesis.sensitivity.outputs
    square = tested.noise[outputs.index(output)].mean_square if output in outputs else np.nan
    return float(np.sqrt(square))
