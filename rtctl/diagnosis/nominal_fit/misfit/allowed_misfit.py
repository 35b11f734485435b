"""The misfit of a nominal model that is no gap, since its identification never claimed to be closer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.problem.problem import Problem


def allow_misfit(problem: Problem, promised: Mapping[str, float]) -> Problem:
    """Return the problem with the mean square misfit that is allowed of each output.

    Args:
        problem: Records to fit, and the largest share that their kind of plant allows; as it is where that is 0.
        promised: RMS misfit by output that the model's identification promises; the largest is allowed without one.
    """
    largest, smallest = problem.subject.allowed_share, problem.thresholds.nominal_fit.min_allowed_misfit
    if not largest:
        return problem
    allowed = {}
    for name in problem.records[0].measured:
        size = problem.size(name)
        rms = np.clip(promised.get(name, np.inf), smallest * size, largest * size)
        allowed[name] = float(rms) ** 2
    return replace(problem, allowed=allowed)
