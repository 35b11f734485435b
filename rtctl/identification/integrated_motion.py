"""The displacement of a record that has a velocity or an acceleration alone, about its own mean.

Integrated by s^k / (s^2 + 2 z w s + w^2), k = 1 of a velocity, 0 of an acceleration, as of a seismometer whose own
frequency w lies below the motion's: what is slower, an offset of the reading among it, is left out.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import bilinear, lfilter

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit_record import FitRecord, derivative_order

OWN_FREQUENCY = 0.2
"""w over the motion's dominant angular frequency."""
DAMPING_RATIO = 0.7
FORGOTTEN = 6.0
"""Periods of the motion after which how a record begins adds less than 3 % to the motion."""
AT_REST = 0.1
"""RMS of the first half period over that of the record, below which it begins at rest."""


def integrate_motion(record: FitRecord, output: str, rate: float) -> FloatArray:
    """Return the displacement (n,) of a record, without its first periods if it does not begin at rest.

    Args:
        record: Record of the motion.
        output: "velocity" or "acceleration", in any unit; the displacement is in that unit times s or s^2.
        rate: Dominant angular frequency of the motion [1/s].
    """
    values, own = record.measured[output], OWN_FREQUENCY * rate
    numerator = [1.0] if derivative_order(output) == 2 else [1.0, 0.0]
    law = bilinear(numerator, [1.0, 2.0 * DAMPING_RATIO * own, own**2], fs=1.0 / record.period_s)
    found: FloatArray = np.asarray(lfilter(*law, values))
    period = 2.0 * math.pi / (rate * record.period_s)
    first = values[: max(1, round(0.5 * period))]
    begins_at_rest = np.mean(first**2) < AT_REST**2 * np.mean(values**2)
    begin = 0 if begins_at_rest else round(FORGOTTEN * period)
    return found[begin:] if 2 * begin < len(found) else found
