"""A portmanteau test of the residual against the past of motion and drive."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.residual.directions import MEMORY
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis
from rtctl.diagnosis.residual.testing.direction_tests import run_block_test
from rtctl.diagnosis.residual.testing.metrics import ScoreMetric
from rtctl.diagnosis.residual.testing.result import ResidualTest


def run_memory_test(analysis: ResidualAnalysis, metrics: Sequence[ScoreMetric] = ()) -> ResidualTest | None:
    """Test whether the residual depends on past motion and drive, or on their powers.

    Null hypothesis: the residual is uncorrelated with y, y^2, y^3, u and u^3 at all lags (`lags.lagged_series`), as it
    is where the model is complete. Statistic: the score statistic of these series together, chi-squared with their
    rank; a portmanteau test in the manner of S. A. Billings, W. S. F. Voon, Int. J. Control 44 (1986) 235.

    Args:
        analysis: Residual to test.
        metrics: As of `run_single_mechanism_test`.

    Returns:
        The test; None where no lagged series is visible.
    """
    past = [k for k, direction in enumerate(analysis.directions) if direction.coordinate == MEMORY]
    return run_block_test(analysis, "past motion and drive", past, metrics)
