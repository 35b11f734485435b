"""A rank test of heteroscedasticity: does the residual grow with the motion, which noise does not?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import RecordRows, unexplained_residual
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis
from rtctl.diagnosis.residual.testing.result import ResidualTest
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel

NAME = "residual grows with the motion"


def run_growth_test(analysis: ResidualAnalysis) -> ResidualTest:
    """Test whether the variance of the unexplained residual grows with the amplitude of the simulated motion.

    Null hypothesis: in blocks of a record, the variance of the whitened unexplained residual does not rise with the
    amplitude. Statistic: Spearman's rank correlation of log variance and log amplitude, each about its mean in the
    record, since a bench may have been noisier on one day than on another; one-sided. The amplitude is that of the
    simulated motion: where a ring-down has died away, the size of a reading is that of its own noise.

    Returns:
        The test, with p = 1 where no record is long enough.

    Reference: C. Spearman, Am. J. Psychology 15 (1904) 72; as a test of heteroscedasticity, W. H. Greene, Econometric
    Analysis, ch. 9.
    """
    from scipy.stats import spearmanr

    variances, amplitudes = list[FloatArray](), list[FloatArray]()
    rows = in_own_noise(analysis.rows, analysis.noise, analysis.problem.thresholds.residual)
    left = unexplained_residual(rows, analysis.noise, analysis.problem.thresholds.residual)
    for index, unexplained in enumerate(left):
        blocks = _log_blocks(analysis, index, unexplained)
        if blocks is not None:
            variances.append(blocks[0] - blocks[0].mean())
            amplitudes.append(blocks[1] - blocks[1].mean())
    if not variances:
        return ResidualTest(NAME, 0.0, 0, 1.0)
    x, y = np.concatenate(amplitudes), np.concatenate(variances)
    if not (np.ptp(x) > 0.0 and np.ptp(y) > 0.0):
        return ResidualTest(NAME, 0.0, 0, 1.0)
    ranked = spearmanr(x, y, alternative="greater")
    return ResidualTest(NAME, float(ranked.statistic), 1, float(ranked.pvalue))


def _log_blocks(
    analysis: ResidualAnalysis, index: int, unexplained: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return log variance and log amplitude (blocks,) of a record; None where it has too few blocks."""
    problem, record = analysis.problem, analysis.problem.records[index]
    thresholds = problem.thresholds.residual
    turns = thresholds.growth_block_periods * 2.0 * np.pi
    block = max(thresholds.growth_least_block, round(turns / problem.scales.rate / record.period_s))
    motion = record.measured[problem.subject.output][record.first :] + analysis.rows[index].residual[0]
    count = len(motion) // block
    if count < thresholds.growth_least_blocks:
        return None
    white = analysis.noise[0].for_period(record.period_s).whiten(unexplained[0])[: count * block]
    variance = np.mean(white.reshape(count, block) ** 2, axis=1)
    amplitude = np.std(motion[: count * block].reshape(count, block), axis=1)
    return np.log(variance + 1e-12), np.log(amplitude + 1e-300)


def in_own_noise(
    rows: Sequence[RecordRows], noise: Sequence[NoiseModel], thresholds: ResidualThresholds
) -> list[RecordRows]:
    """Return each record in units of its own noise.

    What the noise of a loud record makes the parameters err by is then no gap of a quiet one.

    Args:
        rows: Records.
        noise: Noise model of each output.
        thresholds: What is round-off.
    """
    scaled = []
    for row, left in zip(rows, unexplained_residual(rows, noise, thresholds), strict=True):
        white = [model.for_period(row.period_s).whiten(one) for model, one in zip(noise, left, strict=True)]
        factor = 1.0 / np.array([float(one.std()) or 1.0 for one in white])[:, None]
        scaled.append(
            replace(
                row,
                residual=row.residual * factor,
                shared=row.shared * factor,
                local=row.local * factor,
                directions=row.directions * factor,
            )
        )
    return scaled
