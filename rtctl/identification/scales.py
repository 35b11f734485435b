"""How large the motion of a dataset is: what a parameter is compared with, so that every unknown is of order one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter
from rtctl.identification.fit_record import FitRecord

LONGEST_SPECTRUM = 2**16
FLOOR_MARGIN = 20.0
"""Of the noise floor: no bin of white noise is so high, even in a spectrum of many."""


def estimate_scales(
    records: Sequence[FitRecord], output: str = "displacement", drive: str = "drive"
) -> Scales:
    """RMS sizes over all `records`; velocity and acceleration from the dominant angular frequency."""
    rate = find_dominant_rate(records, output)
    readings = [record.measured[output] for record in records]
    displacement = _rms(readings)
    return Scales(
        displacement=displacement,
        velocity=rate * displacement,
        acceleration=rate**2 * displacement,
        drive=_rms([record.stimulus.inputs[drive] for record in records if drive in record.stimulus.inputs]),
        rate=rate,
        duration=max(record.samples * record.period_s for record in records),
        period=min(record.period_s for record in records),
        excursion=_rms([values - values.mean() for values in readings]),
    )


def find_dominant_rate(records: Sequence[FitRecord], output: str = "displacement") -> float:
    """Angular frequency [1/s] where most of the motion is: the peak of the mean spectrum of the velocity of `output`.

    Of the velocity, because hopping between two wells is slow and large; less the noise floor, which a velocity's
    spectrum would make steep. Records are cut into pieces of one length, so a long one says as much as many short.
    """
    period_s = min(record.period_s for record in records)
    length = int(min(LONGEST_SPECTRUM, max(record.samples for record in records)))
    window = np.hanning(length)
    power = np.zeros(length // 2 + 1)
    for record in records:
        z = record.measured[output]
        for begin in range(0, max(1, len(z) - length + 1), length):
            piece = z[begin : begin + length]
            piece = piece - piece.mean()
            power += np.abs(np.fft.rfft(piece * window[: len(piece)], length)) ** 2
    floor = float(np.median(power[-max(1, len(power) // 5) :]))
    above = np.maximum(power - FLOOR_MARGIN * floor, 0.0) * np.arange(len(power)) ** 2
    peak = max(1, int(np.argmax(above)))
    return 2.0 * np.pi * peak / (length * period_s)


def compute_parameter_scales(parameters: Sequence[FreeParameter], scales: Scales) -> FloatArray:
    """The size (parameters,) at which each matters as much as the rest of the equation; its own where that is none."""
    found = []
    for parameter in parameters:
        with np.errstate(all="ignore"):
            try:
                scale = abs(float(parameter.declared.scale(scales)))
            except ZeroDivisionError:
                scale = 0.0
        found.append(scale if np.isfinite(scale) and scale > 0.0 else abs(parameter.value) or 1.0)
    return np.array(found)


def _rms(arrays: Sequence[FloatArray]) -> float:
    count = sum(len(values) for values in arrays)
    return float(np.sqrt(sum(float(values @ values) for values in arrays) / count)) if count else 0.0
