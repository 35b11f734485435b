"""How much of the signals a fitted model leaves."""

from __future__ import annotations

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem


def relative_misfit(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the RMS residual over the RMS of the signals about their means, of all outputs together."""
    signal = 0.0
    for name in hypothesis.sensitivity.outputs:
        readings = np.concatenate([record.measured[name][record.first :] for record in problem.records])
        signal += float(np.sum((readings - readings.mean()) ** 2)) / problem.size(name) ** 2
    return float(np.sqrt(2.0 * hypothesis.cost / signal)) if signal > 0.0 else np.inf
