"""Amplitude density of a record that integrates to its mean square, also where most of it is a transient at an end.

Segments of length 4 h begin each h samples, the first 3 h / 2 before the record, which is mirrored at both of its ends.
With the squares w^2 of a Hann window, segments and mirror images give every sample the weight sum(w^2) / h = 3/2.
Welch's average by itself leaves out most of a transient at an end. A mirror makes a kink, whose spectrum is wide, so
the two segments at an end count only where they hold more than the others; else these stand for them.
Reference: P. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; the mirror is ours.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

HOPS = 18
"""Steps h in a record: fewer would be too ragged to compare, more would blur a resonance."""
LEAST_SEGMENT, LONGEST_SEGMENT = 16, 32_768
ENDS = 2
"""Segments at each end that reach into the mirror."""
TRANSIENT = 2.0
"""Power of a segment at an end over the mean of those within the record, from which it counts."""


def amplitude_density(
    values: FloatArray, period_s: float, *, remove_mean: bool = True, segment: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and one-sided amplitude density [unit of `values`/sqrt(Hz)].

    Args:
        values: Record (n,).
        period_s: Sample period [s].
        remove_mean: Whether the mean, and the frequency 0, are left out.
        segment: Samples of a segment, at most; None: as many as `HOPS` asks for.
    """
    usual = max(4 * len(values) // HOPS, LEAST_SEGMENT) if segment is None else segment
    hop = max(2, 2 * (min(usual, LONGEST_SEGMENT, len(values)) // 8))
    used = values[: max(1, len(values) // hop) * hop] - (values.mean() if remove_mean else 0.0)
    frequency: FloatArray = np.fft.rfftfreq(4 * hop, period_s).astype(np.float64)
    power = _mean_power(_segment_powers(used, hop))
    total = float(power.sum()) * frequency[1]
    density: FloatArray = np.sqrt(power * (float(np.mean(used**2)) / total if total > 0.0 else 0.0))
    first = 1 if remove_mean else 0  # no logarithmic axis has a zero
    return frequency[first:], density[first:]


def _segment_powers(values: FloatArray, hop: int) -> FloatArray:
    """Return the one-sided power (segments, frequencies) of each segment."""
    from scipy.signal import spectrogram

    mirrored = np.pad(values, 3 * hop // 2, mode="symmetric")
    *_, powers = spectrogram(mirrored, window="hann", nperseg=4 * hop, noverlap=3 * hop, detrend=False)
    return np.asarray(powers.T)


def _mean_power(powers: FloatArray) -> FloatArray:
    """Return the mean (frequencies,) over all segments, those within the record in place of ends without more."""
    count = len(powers)
    if count <= 2 * ENDS:
        return np.asarray(powers.mean(axis=0))
    within = powers[ENDS:-ENDS].mean(axis=0)
    ends = np.concatenate((powers[:ENDS], powers[-ENDS:]))
    counts = ends.sum(axis=1) > TRANSIENT * within.sum()
    used = np.where(counts[:, None], ends, within).sum(axis=0)
    return np.asarray(((count - 2 * ENDS) * within + used) / count)
