"""Metrics in which score tests are taken: the noise, the noise beside an allowed misfit, uneven noise.

A nominal model may claim no more than a limited accuracy. Its allowed misfit is no gap: a score test then has a
noncentral chi-squared distribution, whose noncentrality is what of that misfit may lie along the tested directions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ncx2

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import Projected, project, share_by_output
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis
from rtctl.diagnosis.residual.testing.robust_scores import RobustScores, robust_scores
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel


class ScoreMetric(NamedTuple):
    """Scores of the directions in units of some noise, and the noncentrality of an allowed misfit."""

    projected: Projected | RobustScores
    """Scores of the directions and their covariance."""
    alone: FloatArray
    """(k,) noncentrality of each direction alone."""
    together: float
    """Noncentrality of many directions together."""
    thresholds: ResidualThresholds

    def p_values(self, chosen: NDArray[np.intp]) -> FloatArray:
        """Return the p-value (c,) of each of the chosen directions alone."""
        removed, least = self.projected.single(), self.thresholds.least_noncentral_share
        return np.array([score_p_value(float(removed[k]), 1, float(self.alone[k]), least) for k in chosen])

    def p_value(self, chosen: NDArray[np.intp]) -> float:
        """Return the p-value of the chosen directions together; 1 where none is visible."""
        statistic, rank = self.projected.block(chosen)
        least = self.thresholds.least_noncentral_share
        return score_p_value(statistic, rank, self.together, least) if rank else 1.0


def score_p_value(
    statistic: float, degrees_of_freedom: int, noncentrality: float, least_noncentral_share: float
) -> float:
    """Return the probability of a (noncentral) chi-squared variable at least as large as `statistic`.

    Args:
        statistic: Score statistic.
        degrees_of_freedom: Its rank.
        noncentrality: Squares of the allowed misfit along the directions; 0: central.
        least_noncentral_share: Fraction of the noncentrality below which the probability is taken to be 1, since
            SciPy's distribution overflows there.
    """
    if statistic <= least_noncentral_share * noncentrality:
        return 1.0
    if noncentrality > 0.0:
        return float(ncx2.sf(statistic, degrees_of_freedom, noncentrality))
    return float(chi2.sf(statistic, degrees_of_freedom))


def noise_metric(analysis: ResidualAnalysis) -> ScoreMetric:
    """Return the metric of the noise alone: every misfit counts."""
    nothing = np.zeros(len(analysis.directions))
    return ScoreMetric(analysis.projected, nothing, 0.0, analysis.problem.thresholds.residual)


def robust_metric(analysis: ResidualAnalysis) -> ScoreMetric:
    """Return the metric of noise whose size may differ from sample to sample."""
    scores = robust_scores(
        analysis.rows, analysis.noise, analysis.projected, analysis.problem.thresholds.residual.most_leverage
    )
    return noise_metric(analysis)._replace(projected=scores)


def allowed_metrics(analysis: ResidualAnalysis) -> tuple[ScoreMetric, ScoreMetric]:
    """Return two metrics in which the allowed misfit of the problem is no gap.

    In the metric of the noise, which has the colour of a static model's errors too, a fast effect stands out and a
    slow one is hidden. By plain squares, as the allowed size is meant, a slow effect counts that is beyond the noise.

    Returns:
        The metric of the noise's colour, and that of plain squares.
    """
    problem, noise = analysis.problem, analysis.noise
    thresholds = problem.thresholds.residual
    allowed = np.array([problem.allowed[name] for name in analysis.hypothesis.sensitivity.outputs])
    powers = np.array([max(model.mean_square, 1e-300) for model in noise])
    wider = 1.0 + allowed / powers
    coloured = [model.scale_variance(k) for model, k in zip(noise, wider, strict=True)]
    plain = [NoiseModel(np.empty(0), power * k) for power, k in zip(powers, wider, strict=True)]
    squares = sum(row.residual.shape[1] for row in analysis.rows) * allowed / (powers * wider)
    return (
        _allowed_metric(analysis, coloured, squares, thresholds.allowed_coloured),
        _allowed_metric(analysis, plain, squares, thresholds.allowed_by_size),
    )


def _allowed_metric(
    analysis: ResidualAnalysis, noise: list[NoiseModel], squares: FloatArray, shares: tuple[float, float]
) -> ScoreMetric:
    """Return the metric in which `shares` of a misfit of `squares` (outputs,) may lie along one direction, or many.

    Along a direction that is spread over the outputs by shares lies (sum sqrt(share x squares))^2 at most.
    """
    thresholds = analysis.problem.thresholds.residual
    projected = project(analysis.rows, noise, thresholds)
    by_output = share_by_output(projected, analysis.rows, noise)
    along = np.sum(np.sqrt(by_output * squares[:, None]), axis=0) ** 2
    alone = np.where(
        _corrects_identification(analysis), max(shares[0], thresholds.allowed_correction), shares[0]
    )
    return ScoreMetric(projected, alone * along, shares[1] * float(squares.sum()), thresholds)


def _corrects_identification(analysis: ResidualAnalysis) -> NDArray[np.bool_]:
    """Return which directions (k,) are those of a mechanism that corrects what was identified."""
    simulation = analysis.hypothesis.simulation
    ids = {one.mechanism for one in analysis.directions if one.mechanism}
    corrections = {name for name in ids if simulation.extended((name,)).mechanisms[-1].of_identification}
    return np.array([one.mechanism in corrections for one in analysis.directions])
