"""An F-test on repeats of one input: what repeats is no noise, whatever it looks like."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import f as f_distribution

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import residual_beyond_parameters
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis
from rtctl.diagnosis.residual.testing.result import ResidualTest
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel, group_by_period

NAME = "something that repeats"


def run_repeats_test(analysis: ResidualAnalysis) -> ResidualTest | None:
    """Test whether the mean residual of repeats of one input is larger than their scatter explains.

    It is taken beyond the model's own parameters: the residual is that of finer steps than the fit's, which move it
    along the parameters in each record alike. See `f_test_repeats`.

    Returns:
        The test; None without repeats.
    """
    residuals = residual_beyond_parameters(analysis.rows, analysis.projected)
    outputs = analysis.hypothesis.sensitivity.outputs
    return f_test_repeats(residuals, analysis.noise, analysis.problem.records, outputs)


def f_test_repeats(
    residuals: Sequence[FloatArray],
    noise: Sequence[NoiseModel],
    records: Sequence[FitRecord],
    outputs: Sequence[str],
) -> ResidualTest | None:
    """Compare the mean of repeats with their scatter (lack-of-fit test).

    Null hypothesis: the whitened residuals of m repeats are independent noise. Their mean is then independent of the
    scatter about it, and the statistic, m mean^2 per sample over scatter^2 / (m - 1) per sample, is F-distributed.

    Args:
        residuals: Residual (outputs, n) of each record, in the outputs' units.
        noise: Noise model of each output.
        records: Records; those of one letter in `repeat` had the same input.
        outputs: Names of the outputs.

    Returns:
        The test with the degrees of freedom of the numerator; None without repeats.

    Reference: N. R. Draper, H. Smith, Applied Regression Analysis (1998), section 2.1.
    """
    common = deviations = 0.0
    freedom = rest = 0
    for group in _repeated(records):
        length = min(residuals[k].shape[1] for k in group)
        models = [model.for_period(records[group[0]].period_s) for model in noise]
        for o, (name, model) in enumerate(zip(outputs, models, strict=True)):
            readings = np.stack([records[k].measured[name][records[k].first :][:length] for k in group])
            scatter = model.whiten(readings - readings.mean(axis=0))
            mean = model.whiten(np.mean([residuals[k][o, :length] for k in group], axis=0)[None])
            common += len(group) * float(np.sum(mean**2))
            deviations += float(np.sum(scatter**2))
            freedom, rest = freedom + length, rest + length * (len(group) - 1)
    if not freedom or not deviations > 0.0:
        return None
    statistic = (common / freedom) / (deviations / rest)
    return ResidualTest(NAME, statistic, freedom, float(f_distribution.sf(statistic, freedom, rest)))


def _repeated(records: Sequence[FitRecord]) -> Iterator[list[int]]:
    """Yield the indices of records with one input, one first scored sample and one sample period."""
    for letter in dict.fromkeys(record.repeat for record in records if record.repeat is not None):
        group = [k for k, record in enumerate(records) if record.repeat == letter]
        periods = [records[k].period_s for k in group]
        firsts = {records[k].first for k in group}
        if len(group) > 1 and len(firsts) == 1 and len(group_by_period(periods)) == 1:
            yield group
