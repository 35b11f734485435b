"""Displacement and velocity from a record that has neither: the measured derivative is integrated in the spectrum.

What is far below the motion is left out, since an offset of the reading would grow without bound. It serves estimates
from which fits start; the fits themselves compare what was measured.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.motion import DERIVATIVES
from rtctl.identification.fit_record import FitRecord, derivative_order, response_of
from rtctl.identification.scales import find_dominant_rate

MOST_AMPLIFIED = 10.0
"""Times by which noise below the motion's frequency is amplified more than the motion; what would be is left out."""

PERIODS_DISTURBED = 1.5
"""Periods of the lowest frequency that is kept, over which the ends of a record disturb an integral."""


def estimate_motion(record: FitRecord, wanted: str) -> FloatArray:
    """Return `wanted` (n,), "displacement" or "velocity", as it was measured, or integrated from its lowest derivative.

    Args:
        record: Record with at least one response.
        wanted: Name of the response, in its unit.
    """
    if wanted in record.measured:
        return record.measured[wanted]
    source = next(
        (name for name in list(DERIVATIVES)[derivative_order(wanted) :] if name in record.measured), ""
    )
    if not source:
        raise ValueError(f"{wanted} cannot be integrated from {response_of([record])}")
    return _integrate(record, record.measured[source], derivative_order(source) - derivative_order(wanted))


def without_slow_part(record: FitRecord, values: FloatArray) -> FloatArray:
    """Return another signal (n,) of the record without what `estimate_motion` leaves out of an integrated motion."""
    return _integrate(record, values, 0)


def disturbed_samples(record: FitRecord) -> int:
    """Return how many samples at each end of a record an integrated motion is no good estimate.

    The spectrum takes the record for periodic, and its end is joined to its start.
    """
    order = derivative_order(response_of([record]))
    return round(PERIODS_DISTURBED * 2.0 * np.pi / (_lowest_rate(record) * record.period_s)) if order else 0


def _lowest_rate(record: FitRecord) -> float:
    from_displacement = derivative_order(response_of([record]))
    return float(find_dominant_rate([record]) / MOST_AMPLIFIED ** (1.0 / from_displacement))


def _integrate(record: FitRecord, values: FloatArray, times: int) -> FloatArray:
    lowest = _lowest_rate(record)
    rates = 2.0 * np.pi * np.fft.rfftfreq(len(values), record.period_s)
    spectrum = np.fft.rfft(values)
    kept = rates > lowest
    spectrum[kept] /= (1j * rates[kept]) ** times
    spectrum[~kept] = 0.0
    integrated: FloatArray = np.fft.irfft(spectrum, len(values))
    return integrated
