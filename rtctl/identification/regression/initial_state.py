"""Estimate of the state at an instant from noisy displacements: a local cubic by least squares, never a difference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.motion import DERIVATIVES
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.integrated_motion import estimate_motion

DEGREE = 3
SHARE_OF_HALF_WIDTH = 1.0 / 3.0
"""Reach relative to the weak form's half-width: a tenth of a period, over which a cubic follows a motion."""
MIN_REACH_SAMPLES = 3  # samples to each side: seven points for four coefficients


def estimate_initial_state(
    record: FitRecord, at: int, half_width_s: float, states: Sequence[str] = ("displacement", "velocity")
) -> FloatArray:
    """Estimate the states (states,) at a sample; one-sided at the record's ends.

    A velocity that was measured is smoothed itself, and what is below the measured derivative is integrated; a state
    that is neither displacement nor velocity is 0.

    Args:
        record: Record with a measured response.
        at: Index of the sample.
        half_width_s: Half-width of the weak form [s].
        states: Names of the states.
    """
    reach = max(MIN_REACH_SAMPLES, round(SHARE_OF_HALF_WIDTH * half_width_s / record.period_s))
    begin, end = max(0, at - reach), min(record.samples, at + reach + 1)
    x = (np.arange(begin, end) - at) / reach
    found = []
    for name in states:
        if name not in ("displacement", "velocity") or not record.measured.keys() & set(DERIVATIVES):
            found.append(0.0)
            continue
        slope = name == "velocity" and name not in record.measured and "displacement" in record.measured
        source, derivative = ("displacement", 1) if slope else (name, 0)
        degree = min(DEGREE, end - begin - 1)
        fit = np.polynomial.polynomial.polyfit(x, estimate_motion(record, source)[begin:end], degree)
        found.append(float(fit[derivative]) / (reach * record.period_s) ** derivative)
    return np.array(found)


def read_initial_state(record: FitRecord, states: Sequence[str] = ("displacement", "velocity")) -> FloatArray:
    """Return the initial state that the record gives: `initial`, else its first sample at rest."""
    found = []
    for name in states:
        known = name == "displacement" and name in record.measured
        default = float(record.measured[name][0]) if known else 0.0
        found.append(float(record.stimulus.initial.get(name, default)))
    return np.array(found)
