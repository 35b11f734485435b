"""Typical sizes of the motion in a dataset; parameters are scaled with them so that every unknown is of order one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter
from rtctl.identification.fit_record import FitRecord, derivative_order, response_of

LONGEST_SPECTRUM = 2**16
MAIN_LOBE = 2
"""Periods in a piece up to which a Hann window spreads what is constant, and most of a drift."""
CELLS_A_DECADE = 12
PROMINENT = 100.0
"""Ratio of the power of a peak to the lowest before it, from which on it is the motion's."""
FLOOR_MARGIN = 20.0
"""Multiple of the noise floor that no bin of a white noise's spectrum reaches, even of a long one."""


def estimate_scales(records: Sequence[FitRecord], output: str | None = None, drive: str = "drive") -> Scales:
    """Return RMS sizes over all `records`; what is not measured follows from the dominant angular frequency.

    Args:
        records: Records of the motion.
        output: Reading of the motion; None: the first of displacement, velocity and acceleration that all records have.
        drive: Input of the plant.
    """
    output = output or response_of(records)
    swept = "frequency" in records[0].stimulus.inputs
    rate = find_resonance(records, output) if swept else find_dominant_rate(records, output)
    readings = [record.measured[output] / rate ** derivative_order(output) for record in records]
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
        reading=rate ** derivative_order(output) * displacement,
        largest_drive=_largest(
            [one.stimulus.inputs[drive] for one in records if drive in one.stimulus.inputs]
        ),
        largest_reading=_largest([record.measured[output] for record in records]),
    )


def find_largest_displacement(
    records: Sequence[FitRecord], rate: float | None = None, zero: float = 0.0
) -> float:
    """Return the largest scored displacement, or about that of a velocity or acceleration, from its angular frequency.

    Args:
        records: Records of the motion.
        rate: Angular frequency of the motion [1/s]; None: the dominant one.
        zero: What the sensor reads at zero, of a displacement.
    """
    output = response_of(records)
    zero = 0.0 if derivative_order(output) else zero
    scored = [record.measured[output][record.first :] for record in records]
    if "frequency" in records[0].stimulus.inputs:
        scored, zero = [np.hypot(values[::2], values[1::2]) for values in scored], 0.0
    scored = [values - zero for values in scored]
    largest = _largest(scored)
    order = derivative_order(output)
    if not order:
        return largest
    if rate is None:
        rate = estimate_scales(records, output).rate
    return largest / rate**order


def find_longest_time(records: Iterable[FitRecord]) -> float:
    """Return the duration [s] of the longest record, parts of one taken together; of a sweep its longest period."""
    return max((_time_of(record) for record in records), default=0.0)


def _time_of(record: FitRecord) -> float:
    frequencies = record.stimulus.inputs.get("frequency")
    if frequencies is None:
        return (record.begin + record.samples) * record.period_s
    return float(1.0 / frequencies.min()) if frequencies.min() > 0.0 else 0.0


def find_resonance(records: Sequence[FitRecord], output: str) -> float:
    """Return the angular frequency [1/s] at which sweeps have their largest velocity over the drive."""
    largest, found = -1.0, 0.0
    for record in records:
        values = record.measured[output]
        rate = 2.0 * np.pi * record.stimulus.inputs["frequency"][::2]
        drive = record.stimulus.inputs["drive"][::2]
        velocity = np.hypot(values[::2], values[1::2]) * rate ** (1.0 - derivative_order(output)) / drive
        at = int(np.argmax(velocity))
        if velocity[at] > largest:
            largest, found = float(velocity[at]), float(rate[at])
    return found


def find_dominant_rate(records: Sequence[FitRecord], output: str | None = None) -> float:
    """Return the angular frequency [1/s] at the peak of the mean spectrum of the velocity, that of `output`.

    The velocity is used because hopping between two wells is slow and large. The noise floor is subtracted first, as
    the
    factor from displacement to velocity would make it steep. Records are cut into pieces of one length, so that a long
    record counts as much as many short ones.
    """
    output = output or response_of(records)
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
    to_velocity = np.arange(1, len(power)) ** (1.0 - derivative_order(output))
    above = np.maximum(power[1:] - FLOOR_MARGIN * floor, 0.0) * to_velocity**2
    peak = 1 + int(np.argmax(above))
    if derivative_order(output) and peak <= MAIN_LOBE:
        peak = _prominent_peak(power[1:] * to_velocity**2, peak)
    return 2.0 * np.pi * peak / (length * period_s)


def _prominent_peak(power: FloatArray, otherwise: int) -> int:
    """Return the number of the value (from 1) that stands out most of what lies before it, if it does so clearly.

    A drift of an accelerometer, integrated, is larger than any motion, and falls towards the motion's frequency.
    """
    count = max(2, int(CELLS_A_DECADE * np.log10(len(power))))
    edges = np.unique(np.geomspace(1, len(power), count).astype(int)) - 1
    cells = np.add.reduceat(power, edges) / np.diff(np.append(edges, len(power)))
    lowest = np.minimum.accumulate(np.maximum(cells, 1e-300))
    best = int(np.argmax(cells / lowest))
    if cells[best] < PROMINENT * lowest[best]:
        return otherwise
    end = edges[best + 1] if best + 1 < len(edges) else len(power)
    return int(edges[best]) + 1 + int(np.argmax(power[edges[best] : end]))


def compute_parameter_scales(parameters: Sequence[FreeParameter], scales: Scales) -> FloatArray:
    """Return the size (parameters,) at which each parameter matters as much as the rest of the equation.

    Where a parameter declares none, its own magnitude is taken, or 1.
    """
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
    """Return the RMS over all `arrays` together."""
    count = sum(len(values) for values in arrays)
    return float(np.sqrt(sum(float(values @ values) for values in arrays) / count)) if count else 0.0


def _largest(arrays: Sequence[FloatArray]) -> float:
    """Return the largest magnitude of all `arrays`."""
    return max((float(np.abs(values).max()) for values in arrays if len(values)), default=0.0)
