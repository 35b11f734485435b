"""Whether the re-fitted nominal model leaves so much that it may be a model of another device."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.problem.problem import Problem

FOREIGN_SHARE = 0.6
"""Of the signal's RMS that a re-fitted model of the same device would not leave."""


def foreign(problem: Problem, outputs: Sequence[str], cost: float) -> list[str]:
    """Warning where the re-fitted nominal model, at this cost of a fit, leaves most of the signal."""
    output = problem.subject.output
    power = 0.0
    for record in problem.records:
        for name in outputs:
            signal = record.measured[name][record.first :] / problem.size(name)
            power += float(np.sum((signal - signal.mean()) ** 2))
        share = float(np.sqrt(2.0 * cost / max(power, 1e-300)))
    if not share > FOREIGN_SHARE:
        return []
    return [
        f"the nominal model, re-fitted, leaves {share:.0%} of the {output}'s RMS: is it a model of this device, "
        "are the units and signs right? A cause named on this basis is doubtful; try rtctl identify first"
    ]
