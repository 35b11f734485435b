"""May a hypothesis be claimed? Only if nothing else is left in its residual.

At the fitted hypothesis, every direction that is not its own is tested against the noise: each mechanism of the
catalogue, the catalogue together, the generic forces, past motion and drive; then whether the residual grows with the
motion, and whether it repeats where an input was repeated. The smallest p-value counts, times the number of tests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import Direction
from rtctl.diagnosis.residual.input_noise import InputNoise, find_input_noise
from rtctl.diagnosis.residual.projection import Projected
from rtctl.diagnosis.residual.testing import (
    ResidualAnalysis,
    ResidualTest,
    analyse_residual,
    run_catalogue_test,
    run_generic_force_test,
    run_growth_test,
    run_memory_test,
    run_repeats_test,
    run_single_mechanism_test,
)
from rtctl.diagnosis.residual.testing.metrics import (
    ScoreMetric,
    allowed_metrics,
    noise_metric,
    robust_metric,
)
from rtctl.identification.noise.residual_noise import NoiseModel

SCORE_TESTS = (run_single_mechanism_test, run_catalogue_test, run_generic_force_test, run_memory_test)


class TestedHypothesis(NamedTuple):
    """A hypothesis at its optimum, and the tests of its residual."""

    hypothesis: Hypothesis
    directions: tuple[Direction, ...]
    """Directions (k) in which it may be wrong."""
    projected: Projected
    """Residual and directions beyond its parameters, in units of the noise."""
    noise: tuple[NoiseModel, ...]
    """Noise model of each output."""
    tests: tuple[ResidualTest, ...]
    input_noise: InputNoise | None = None
    """Noise of the recorded input that is in the residual and that the tests do without."""

    @property
    def p_value(self) -> float:
        """Smallest p-value of the tests, times their number (Bonferroni)."""
        return min(1.0, min(test.p_value for test in self.tests) * len(self.tests))


def run_residual_tests(
    hypothesis: Hypothesis, problem: Problem, ids: Sequence[str], noise: Sequence[NoiseModel] | None = None
) -> TestedHypothesis:
    """Run all tests of the residual of a fitted hypothesis.

    Args:
        hypothesis: Fitted hypothesis, at its optimum.
        problem: Problem that it was fitted to.
        ids: Ids of the catalogue's mechanisms.
        noise: Noise model of each output, from a better hypothesis; None: estimated from this residual.

    Raises:
        ArithmeticError: if the optimum is at the edge of divergence.
    """
    analysis = analyse_residual(hypothesis, problem, ids, noise)
    tests, input_noise = run_score_tests(analysis), None
    doubted = problem.thresholds.residual.robust_below_p
    may_be_noise = noise is None and not problem.allowed
    if may_be_noise and min(one.p_value for one in tests) < doubted:
        found = find_input_noise(analysis)
        if found is not None:
            analysis, input_noise = found
            tests = run_score_tests(analysis)
    if noise is None and problem.subject.growth_is_misfit and not analysis.is_quantized:
        tests.append(run_growth_test(analysis))
    if not problem.allowed and not analysis.is_quantized and (repeats := run_repeats_test(analysis)):
        tests.append(repeats)
    if is_numerical(hypothesis, problem):
        tests = [test._replace(p_value=1.0) for test in tests]
    tested = TestedHypothesis(
        hypothesis, analysis.directions, analysis.projected, analysis.noise, tuple(tests), input_noise
    )
    return _without_drive_noise(tested, problem)


def project_plainly(tested: TestedHypothesis, problem: Problem, ids: Sequence[str]) -> TestedHypothesis:
    """Return a tested hypothesis whose directions are projected by plain squares, as fits weigh them; tests stay.

    It is the same where the optimum is at the edge of divergence.
    """
    sizes = (problem.size(name) for name in tested.hypothesis.sensitivity.outputs)
    white = [NoiseModel(np.empty(0), size**2) for size in sizes]
    try:
        analysis = analyse_residual(tested.hypothesis, problem, ids, white)
    except ArithmeticError:
        return tested
    return tested._replace(directions=analysis.directions, projected=analysis.projected)


def _without_drive_noise(tested: TestedHypothesis, problem: Problem) -> TestedHypothesis:
    """Return a residual that is no finding where it is what noise leaves that was taken off the drive in part."""
    rest = problem.thresholds.residual.unseparated_noise * problem.taken_off
    projected = tested.projected
    excess = projected.residual / max(projected.samples - projected.rank, 1) - 1.0
    if not (problem.taken_off and excess < rest):
        return tested
    return tested._replace(tests=tuple(test._replace(p_value=1.0) for test in tested.tests))


def is_numerical(hypothesis: Hypothesis, problem: Problem) -> bool:
    """Return whether a residual is no larger than the error of an integration: readings without noise have no other."""
    rms = math.sqrt(2.0 * hypothesis.cost / max(problem.samples, 1))
    return rms < problem.thresholds.residual.numerical_share


def run_score_tests(analysis: ResidualAnalysis) -> list[ResidualTest]:
    """Run the score tests in the metrics that the problem asks for.

    Where a misfit is allowed, they are run in two metrics, and by plain squares a finding must be beyond the noise as
    well. Else a small p-value of a residual that is hardly larger than the noise is checked by a covariance that is
    robust to heteroscedastic noise, and the larger p-value counts.
    """
    if analysis.problem.allowed:
        coloured, by_size = allowed_metrics(analysis)
        plain = _in_metrics(analysis, by_size, noise_metric(analysis))
        return [
            *_in_metrics(analysis, coloured),
            *(test._replace(name=f"{test.name}, by size") for test in plain),
        ]
    metric, projected = noise_metric(analysis), analysis.projected
    tests = _in_metrics(analysis, metric)
    thresholds = analysis.problem.thresholds.residual
    excess = projected.residual / max(projected.samples - projected.rank, 1)
    smallest = min(test.p_value for test in tests)
    if excess < thresholds.robust_below_excess and smallest < thresholds.robust_below_p:
        tests = _in_metrics(analysis, metric, robust_metric(analysis))
    return tests


def _in_metrics(analysis: ResidualAnalysis, *metrics: ScoreMetric) -> list[ResidualTest]:
    results = (run_test(analysis, metrics) for run_test in SCORE_TESTS)
    return [result for result in results if result is not None]
