"""Score tests: does the residual lie along directions in which the hypothesis may be wrong?

Null hypothesis of each: beyond the fitted parameters the residual is noise (or an allowed misfit), so that the score
g = x r of the whitened directions x and residual r has mean zero and covariance V = x x^T. Statistic: g^T V^-1 g, the
squares that a least-squares fit along the directions removes. Distribution: chi-squared with the rank of V as its
degrees of freedom; noncentral where a misfit is allowed, see `metrics`.

Reference: C. R. Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50; T. S. Breusch, A. R. Pagan, Rev. Econ. Studies 47 (1980)
239, for the Lagrange multiplier form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtctl.diagnosis.residual.directions import MEMORY
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis
from rtctl.diagnosis.residual.testing.metrics import ScoreMetric, allowed_metrics, noise_metric
from rtctl.diagnosis.residual.testing.result import ResidualTest


def run_single_mechanism_test(
    analysis: ResidualAnalysis, metrics: Sequence[ScoreMetric] = ()
) -> ResidualTest | None:
    """Test the direction of the catalogue along which the residual is least likely.

    Null hypothesis: no single mechanism acts. Statistic: chi-squared with 1 degree of freedom, of the direction with
    the smallest p-value; Bonferroni's correction multiplies that by the number of directions, and each by the number
    of shapes among which the data chose it.

    Args:
        analysis: Residual to test.
        metrics: Metrics to test in; the largest p-value counts, the statistic is that of the first. None given:
            that of the noise, with the allowed misfit of the problem.

    Returns:
        The test, named after the mechanism; None where the catalogue has no visible direction.
    """
    metrics = metrics or _default_metrics(analysis)
    projected, directions = metrics[0].projected, analysis.directions
    removed = projected.single()
    named = np.array([k for k, d in enumerate(directions) if d.mechanism], dtype=np.intp)
    usable = named[projected.usable[named]]
    if not len(usable):
        return None
    trials = np.array([directions[k].trials for k in usable])
    p_values = np.max([metric.p_values(usable) for metric in metrics], axis=0) * trials
    best = usable[int(np.argmin(np.where(p_values > 0.0, p_values, -removed[usable])))]
    p_value = min(1.0, float(p_values.min()) * len(usable))
    return ResidualTest(f"{directions[best].mechanism} alone", float(removed[best]), 1, p_value)


def run_catalogue_test(
    analysis: ResidualAnalysis, metrics: Sequence[ScoreMetric] = ()
) -> ResidualTest | None:
    """Test all directions of the catalogue together, except those whose shape the data chose.

    Null hypothesis: no mechanism of the catalogue acts. Statistic: chi-squared with the rank of the directions.

    Args:
        analysis: Residual to test.
        metrics: As of `run_single_mechanism_test`.

    Returns:
        The test; None where no direction is visible.
    """
    given = [k for k, d in enumerate(analysis.directions) if d.mechanism and d.trials == 1]
    return run_block_test(analysis, "catalogue", given, metrics)


def run_generic_force_test(
    analysis: ResidualAnalysis, metrics: Sequence[ScoreMetric] = ()
) -> ResidualTest | None:
    """Test all generic forces of the kind of plant together.

    Null hypothesis: no force along any of its coordinates is missing, also none that is in no catalogue. Statistic:
    chi-squared with the rank of the forces.

    Args:
        analysis: Residual to test.
        metrics: As of `run_single_mechanism_test`.

    Returns:
        The test; None where no force is visible.
    """
    forces = [k for k, d in enumerate(analysis.directions) if not d.mechanism and d.coordinate != MEMORY]
    return run_block_test(analysis, "generic forces", forces, metrics)


def run_block_test(
    analysis: ResidualAnalysis, name: str, chosen: Sequence[int], metrics: Sequence[ScoreMetric] = ()
) -> ResidualTest | None:
    """Test chosen directions together.

    Args:
        analysis: Residual to test.
        name: Name of the test.
        chosen: Indices of the directions.
        metrics: As of `run_single_mechanism_test`.

    Returns:
        The test; None where no direction is visible.
    """
    metrics = metrics or _default_metrics(analysis)
    indices: NDArray[np.intp] = np.array(chosen, dtype=np.intp)
    statistic, rank = metrics[0].projected.block(indices)
    if not rank:
        return None
    return ResidualTest(name, statistic, rank, max(metric.p_value(indices) for metric in metrics))


def _default_metrics(analysis: ResidualAnalysis) -> tuple[ScoreMetric, ...]:
    return allowed_metrics(analysis)[:1] if analysis.problem.allowed else (noise_metric(analysis),)
