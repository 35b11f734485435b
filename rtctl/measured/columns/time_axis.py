"""Convert a time column to one sample period: it must be uniform, or is resampled on request."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

TOLERANCE = 1e-3
"""Largest deviation of an interval from the usual one, as a fraction of it."""
ON_LINE = 0.02
"""Largest deviation of stamps from a straight line, in steps, that is their rounding: the rate is then the line's."""
COARSEST_STAMP = 0.5
"""Largest step of rounded stamps, in periods: of coarser ones, a lost sample does not show."""
_SHOWN = 4


MOST_DECIMATED = 500.5
"""Most samples of a device of which a file has one."""
LONGEST_GAP = 5.0
"""Longest interval that resampling bridges, in usual ones: over more, a straight line is no measurement."""


class StatedPeriod(NamedTuple):
    """The sample period that a file states."""

    period_s: float
    key: str
    """Key that holds the period, or where a rate is stated: `by "fs"`."""
    rounding: float = 0.0
    """Relative size of the last digit with which it is written, where that matters."""
    is_of_device: bool = False
    """Whether it may be the rate of the device, of which the file has every second, third, ... sample."""
    is_beside: bool = False
    """Whether a variable beside the columns states it, which may be about something else."""

    @property
    def source(self) -> str:
        """Return what states it: `by "fs"`, `wf_increment = 0.001 s`."""
        return self.key if self.key.startswith("by ") else f"{self.key} = {self.period_s:.6g} s"

    @property
    def is_default(self) -> bool:
        """Return whether programs write it where nobody has set one: 1 s, in a field that the format has for it."""
        return self.period_s == 1.0 and not self.key.startswith("by ")

    def agrees(self, sample_rate_hz: float) -> bool:
        """Return whether a file of that rate may state this period."""
        is_same = abs(self.period_s * sample_rate_hz - 1.0) <= TOLERANCE + self.rounding
        return is_same or decimation(self, sample_rate_hz) > 0


def uniform_period(time_s: FloatArray, name: str, first_row: int, resolution_s: float = 0.0) -> float:
    """Return the period [s] of a uniform time column. Raises ValueError that says where it is not, and by how much.

    Stamps that are rounded to `resolution_s` are uniform if they lie within that of a straight line.
    """
    intervals = rising(time_s, name, first_row)
    mean = float((time_s[-1] - time_s[0]) / len(intervals))
    if resolution_s < COARSEST_STAMP * mean and _is_line(time_s, mean, resolution_s):
        return mean
    usual = float(np.median(intervals))  # the mean would be moved by the very gap that is looked for
    deviation = np.abs(intervals - usual)
    worst = int(np.argmax(deviation))
    if deviation[worst] > TOLERANCE * usual:
        count = int((deviation > TOLERANCE * usual).sum())
        raise ValueError(
            f'time column "{name}" is not uniform: after row {worst + first_row} it goes on by '
            f"{intervals[worst]:.6g} s, usually {usual:.6g} s ({100 * deviation[worst] / usual:.3g} % off, "
            f"allowed {100 * TOLERANCE:g} %; {count} such intervals); correct it, or set resample = true"
        )
    return float((time_s[-1] - time_s[0]) / len(intervals))


def _is_line(time_s: FloatArray, period_s: float, within_s: float) -> bool:
    """Return whether stamps lie within `within_s` of a line; both of its ends may be off by half of that."""
    line = time_s[0] + period_s * np.arange(len(time_s))
    return bool(np.abs(time_s - line).max() <= 1.01 * within_s)


def decimation(stated: StatedPeriod, sample_rate_hz: float) -> int:
    """Return of how many samples of the stated period a file has one, if it may have so few of them; 0: it may not.

    By the numbers of a change of units, 60 or 1000, it is a mistake and no decimation.
    """
    every = 1.0 / (stated.period_s * sample_rate_hz)
    count = round(every) if 1.5 < every <= MOST_DECIMATED else 0
    is_one = count > 0 and abs(every / count - 1.0) <= TOLERANCE + stated.rounding
    return count if stated.is_of_device and is_one and count != 60 else 0  # seconds of a minute


def check_stated_period(
    stated: StatedPeriod | None, name: str, sample_rate_hz: float, other: str = ""
) -> str:
    """Return a remark on a rate that a file states otherwise and may: as one of several samples, in a variable.

    "": all agree. Raises ValueError where a file states another period [s] for a column than the manifest or another
    column.

    Args:
        stated: The period of the column; None: the file states none.
        name: The column.
        sample_rate_hz: The other rate.
        other: What has the other rate, such as `time column "t"`; "": the manifest.
    """
    if stated is None:
        return ""
    rate = in_hz(sample_rate_hz)
    if stated.agrees(sample_rate_hz):
        every = decimation(stated, sample_rate_hz)
        if not every:
            return ""
        return (
            f"the file states {in_hz(1.0 / stated.period_s)} Hz ({stated.source}), its rows are read at {rate} Hz: as "
            f"one of every {every} samples"
        )
    if stated.is_default:
        return (
            f"the file states {stated.source}, as programs do where nobody set it: {other or 'the manifest'} gives "
            f"{rate} Hz, which is taken"
        )
    if stated.is_beside:
        contrary = other or "the manifest"
        return (
            f"beside its columns the file states {in_hz(1.0 / stated.period_s)} Hz ({stated.source}), {contrary} gives "
            f"{rate} Hz, which is taken: are the rows that many a second?"
        )
    contrary = f"{other} goes on at {rate} Hz" if other else f"the manifest sample_rate_hz = {rate}"
    raise ValueError(
        f'the file states {in_hz(1.0 / stated.period_s)} Hz for column "{name}" ({stated.source}), {contrary} '
        f"(allowed difference {100 * (TOLERANCE + stated.rounding):.3g} %); correct one"
    )


def in_hz(rate_hz: float) -> str:
    """Return a rate with six digits and without a power of ten: 2000000, not 2e+06."""
    return f"{float(f'{rate_hz:.6g}'):.12g}"


class Line(NamedTuple):
    """The straight line through stamps over the numbers of their samples, lost ones counted."""

    period_s: float
    instants_s: FloatArray
    """Instants (n,) of the samples on the line [s]."""
    off: float
    """Largest deviation of a stamp from it, in periods."""
    missing: int
    """Samples that have no stamp."""

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] of the samples."""
        return 1.0 / self.period_s


def line_through(time_s: FloatArray, *, lacks_none: bool = False) -> Line:
    """Return the line through rising stamps (n,) [s], two or more, of a uniform clock.

    The median of rounded intervals is off by up to half of their rounding, the line's slope hardly at all. A whole
    number of Hz is taken where the stamps cannot tell it from the line's.

    Args:
        time_s: The stamps.
        lacks_none: Whether every sample has a stamp; otherwise an interval of two or more usual ones lacks some.
    """
    numbers = np.arange(len(time_s), dtype=np.float64)
    if not lacks_none:
        intervals = np.diff(time_s)
        numbers[1:] = np.cumsum(np.rint(intervals / np.median(intervals)))
    about, mean_s = numbers - numbers.mean(), float(time_s.mean())
    period_s = float(about @ (time_s - mean_s) / (about @ about))
    off_s = float(np.abs(time_s - mean_s - period_s * about).max())
    whole = float(round(1.0 / period_s))
    if whole > 0.0 and abs(1.0 / whole - period_s) * (numbers[-1] + 1.0) <= 2.0 * off_s:
        period_s = 1.0 / whole
    missing = int(numbers[-1]) + 1 - len(numbers)
    return Line(period_s, mean_s + period_s * about, off_s / period_s, missing)


def straightened(time_s: FloatArray, name: str, first_row: int, resolution_s: float = 0.0) -> FloatArray:
    """Return the instants (n,) [s] of samples whose stamps are rounded; stamps that are uneven otherwise as they are.

    Raises ValueError with the first row whose stamp is no later.
    """
    rising(time_s, name, first_row)
    if len(time_s) < 3:
        return time_s
    line = line_through(time_s)
    return line.instants_s if line.off <= max(ON_LINE, resolution_s / line.period_s) else time_s


def resampling_grid(time_s: FloatArray, name: str, first_row: int) -> FloatArray:
    """Return uniform instants (m,) [s] from the first to the last, a median interval apart."""
    intervals = rising(time_s, name, first_row)
    usual = float(np.median(intervals))
    _check_gaps(intervals, usual, name, first_row)
    count = int(np.floor((time_s[-1] - time_s[0]) / usual * (1.0 + 1e-9))) + 1
    grid: FloatArray = time_s[0] + usual * np.arange(count)
    return grid


def _check_gaps(intervals: FloatArray, usual: float, name: str, first_row: int) -> None:
    """Raise ValueError with the rows of the parts where intervals are too long to be bridged."""
    gaps = np.flatnonzero(intervals > LONGEST_GAP * usual)
    if not len(gaps):
        return
    longest = int(gaps[np.argmax(intervals[gaps])])
    edges = [first_row, *(gaps + first_row + 1).tolist(), first_row + len(intervals) + 1]
    parts = [f"[{a}, {b}]" for a, b in pairwise(edges) if b - a > 1]
    count = "a gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
    more = f" and {len(parts) - _SHOWN} more" if len(parts) > _SHOWN else ""
    raise ValueError(
        f'time column "{name}" has {count}, the longest of {intervals[longest]:.6g} s after row '
        f"{longest + first_row} (usually {usual:.6g} s; resampling bridges up to {LONGEST_GAP:g} of these). What lies "
        f"between was not measured: make one record of each part, with rows = {', '.join(parts[:_SHOWN])}{more}"
    )


def resampled(values: FloatArray, time_s: FloatArray, grid_s: FloatArray, *, held: bool) -> FloatArray:
    """Return `values` on the grid: linear between samples, or the last one where an input is held between them."""
    if held:
        period = grid_s[1] - grid_s[0] if len(grid_s) > 1 else 0.0
        # a grid point that rounding leaves just before a sample belongs to that sample
        last = np.searchsorted(time_s, grid_s + 1e-6 * period, side="right") - 1
        return values[last]
    return np.interp(grid_s, time_s, values)


def rising(time_s: FloatArray, name: str, first_row: int) -> FloatArray:
    """Return the intervals (n - 1,) of stamps (n,). Raises ValueError with the first row that is no later."""
    intervals: FloatArray = np.diff(time_s)
    stuck = np.flatnonzero(intervals <= 0.0)
    if len(stuck):
        row = int(stuck[0])
        raise ValueError(
            f'time column "{name}" does not increase from row {row + first_row} ({time_s[row]:.9g} s) to '
            f"{row + first_row + 1} ({time_s[row + 1]:.9g} s); sort or correct the file"
        )
    return intervals
