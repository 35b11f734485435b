"""Whether the re-fitted nominal model leaves so much that it may be a model of another device."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.problem.problem import Problem

FOREIGN = (
    "the nominal model, re-fitted, leaves {:.0%} of the {}'s RMS: is it a model of this device, and are "
    "input, output, units and signs in the manifest right? A cause named on this basis is doubtful"
)


def note_foreign_model(problem: Problem, outputs: Sequence[str], cost: float) -> list[str]:
    """Note that the re-fitted nominal model, of this cost, leaves most of the signal."""
    power = 0.0
    for record in problem.records:
        for name in outputs:
            signal = record.measured[name][record.first :] / problem.size(name)
            power += float(np.sum((signal - signal.mean()) ** 2))
    share = float(np.sqrt(2.0 * cost / max(power, 1e-300)))
    if not share > problem.thresholds.nominal_fit.foreign_misfit:
        return []
    return [FOREIGN.format(share, problem.subject.output)]
