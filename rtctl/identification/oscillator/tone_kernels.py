"""Kernels of `tone_cost`: 32 Duffing oscillators marched through a tone, scored while the samples are in the cache.

All values of the lanes stand in one flat array, row after row, with a number of lanes that is known at compile time:
then the compiler sees that no two rows overlap and uses vector instructions. A block of samples is marched, then
scored: no trajectory is stored.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import background_kernel

LANES = 32
BLOCK = 64
"""Samples that are marched before they are scored: 16 kB."""
DZ, DV, PC, PS, E00, E01, E10, E11, ROT_C, ROT_S, KICK = range(11)
"""Rows: d = (z, v) - P, P's phasor, the linear step, the phasor's rotation, h times the cubic stiffness."""
ROWS = 11
SUM, SQUARE, PRODUCT, MIN_ERROR, MAX_ERROR = range(5)
"""Rows of the sums."""


@background_kernel
def _march(w: FloatArray, out: FloatArray, samples: int) -> None:
    """Write `samples` displacements of every lane to `out` (samples x LANES), the first at the current state."""
    for n in range(samples):
        row = n * LANES
        for j in range(LANES):
            out[row + j] = w[DZ * LANES + j] + w[PC * LANES + j]
            c, s = w[PC * LANES + j], w[PS * LANES + j]
            rc, rs = w[ROT_C * LANES + j], w[ROT_S * LANES + j]
            pc = c * rc - s * rs
            w[PC * LANES + j] = pc
            w[PS * LANES + j] = c * rs + s * rc
            dz, dv = w[DZ * LANES + j], w[DV * LANES + j]
            after = w[E00 * LANES + j] * dz + w[E01 * LANES + j] * dv
            z = after + pc
            w[DZ * LANES + j] = after
            w[DV * LANES + j] = (w[E10 * LANES + j] * dz + w[E11 * LANES + j] * dv) - w[KICK * LANES + j] * (
                z * z * z
            )


@background_kernel
def march_and_sum(
    w: FloatArray, measured: FloatArray, first: int, buffer: FloatArray, sums: FloatArray
) -> None:
    """Add sums (5 LANES) over the samples from `first` on: z, z^2, z m, least and largest z - m."""
    total = len(measured)
    for begin in range(0, total, BLOCK):
        count = min(BLOCK, total - begin)
        _march(w, buffer, count)
        for n in range(max(0, first - begin), count):
            m, row = measured[begin + n], n * LANES
            for j in range(LANES):
                z = buffer[row + j]
                e = z - m
                sums[SUM * LANES + j] += z
                sums[SQUARE * LANES + j] += z * z
                sums[PRODUCT * LANES + j] += z * m
                least, most = sums[MIN_ERROR * LANES + j], sums[MAX_ERROR * LANES + j]
                sums[MIN_ERROR * LANES + j] = e if e < least else least
                sums[MAX_ERROR * LANES + j] = e if e > most else most


@background_kernel
def march_and_keep(w: FloatArray, buffer: FloatArray, out: FloatArray) -> None:
    """Write the first lane's displacement to `out`."""
    total = len(out)
    for begin in range(0, total, BLOCK):
        count = min(BLOCK, total - begin)
        _march(w, buffer, count)
        for n in range(count):
            out[begin + n] = buffer[n * LANES]


@background_kernel
def _find_highest(buffer: FloatArray, count: int, highest: FloatArray) -> None:
    """Write the highest value (LANES,) over `count` rows of the buffer."""
    for j in range(LANES):
        highest[j] = -np.inf
    for n in range(count):
        row = n * LANES
        for j in range(LANES):
            z, before = buffer[row + j], highest[j]
            highest[j] = z if z > before else before


@background_kernel
def _find_highest_row(buffer: FloatArray, count: int, highest: FloatArray, where: FloatArray) -> None:
    """Write the row of the highest value (LANES,).

    This is not done in the loop that finds the value: that would branch, and could not be vectorised.
    """
    for n in range(count):
        here, row = float(n), n * LANES
        for j in range(LANES):
            before = where[j]
            where[j] = here if buffer[row + j] == highest[j] else before


@background_kernel
def march_and_match(
    w: FloatArray,
    peaks: IntArray,
    ends: IntArray,
    buffer: FloatArray,
    state: FloatArray,
    mismatch: FloatArray,
) -> None:
    """Add up (LANES,) how far the highest sample of each peak's window is from the record's peak.

    A window reaches from halfway to the peak before (`ends` of it) to halfway to the next; `peaks` has one less.
    """
    highest, where = state[:LANES], state[LANES:]
    begin = 0
    for at in range(len(ends)):
        count = ends[at] - begin
        _march(w, buffer, count)
        if at > 0:
            _find_highest(buffer, count, highest)
            _find_highest_row(buffer, count, highest, where)
            peak, half = float(peaks[at - 1] - begin), 2.0 / count
            for j in range(LANES):
                off = abs(where[j] - peak) * half
                mismatch[j] += off if off < 1.0 else 1.0
        begin = ends[at]
