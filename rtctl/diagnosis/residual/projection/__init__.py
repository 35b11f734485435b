"""What the fitted parameters cannot follow of a residual and of directions, in units of the noise."""

from rtctl.diagnosis.residual.projection.noise_estimate import estimate_noise
from rtctl.diagnosis.residual.projection.projected import (
    Projected,
    project,
    residual_beyond_parameters,
    score_statistic,
    share_by_output,
    solve_least_squares,
    unexplained_residual,
)
from rtctl.diagnosis.residual.projection.rows import RecordRows

__all__ = [
    "Projected",
    "RecordRows",
    "estimate_noise",
    "project",
    "residual_beyond_parameters",
    "score_statistic",
    "share_by_output",
    "solve_least_squares",
    "unexplained_residual",
]
