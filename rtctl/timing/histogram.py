"""Histograms of durations in constant memory: buckets that grow with the value, as HdrHistogram has them.

A value of b bits beyond `BITS` keeps its leading `BITS` ones: 64 buckets an octave, so a quantile is off by at most
1/128 of itself, from 1 ns to 18 minutes, in 2,304 counters. One record is a shift, two additions and an increment.
Reference: G. Tene, HdrHistogram (log-linear buckets).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

BITS = 7
_HALF = 1 << (BITS - 1)
_OCTAVES = 34
BUCKETS = (_OCTAVES + 1) * _HALF + _HALF
_TOP = BUCKETS - 1
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99_9": 0.999}
DECADE = (1.0, 2.0, 5.0)


class Bucket(NamedTuple):
    """Durations `low_ns` to `high_ns` (both included) and how many there were."""

    low_ns: int
    high_ns: int
    durations: int


def bounds_ns(bucket: int) -> tuple[int, int]:
    """Least and largest duration [ns] that falls into a bucket."""
    if bucket < 2 * _HALF:
        return bucket, bucket
    shift = bucket // _HALF - 1
    low = (bucket - shift * _HALF) << shift
    return low, low + (1 << shift) - 1


def bucket_of(duration_ns: int) -> int:
    """The bucket of a duration [ns] >= 0; `Histogram.record` has it in line, for speed."""
    shift = duration_ns.bit_length() - BITS
    return min(duration_ns if shift <= 0 else (shift << (BITS - 1)) + (duration_ns >> shift), _TOP)


class Histogram:
    """Counts of durations [ns]."""

    __slots__ = ("_counts", "count", "largest_ns")

    def __init__(self) -> None:
        self._counts = [0] * BUCKETS
        self.count = 0
        self.largest_ns = 0

    def record(self, duration_ns: int) -> None:
        """One duration; less than nothing counts as nothing, more than 18 minutes as the highest bucket."""
        if duration_ns < 0:
            duration_ns = 0
        shift = duration_ns.bit_length() - BITS
        bucket = duration_ns if shift <= 0 else (shift << (BITS - 1)) + (duration_ns >> shift)
        self._counts[bucket if bucket < BUCKETS else _TOP] += 1
        self.count += 1
        if duration_ns > self.largest_ns:
            self.largest_ns = duration_ns

    def record_many(self, duration_ns: int, times: int) -> None:
        """The same duration so many times; none at all changes nothing."""
        if times > 0:
            self._counts[bucket_of(duration_ns)] += times
            self.count += times
            self.largest_ns = max(self.largest_ns, duration_ns)

    def add(self, counts: NDArray[np.int64], largest_ns: int) -> None:
        """Durations that were counted elsewhere, in the same buckets (BUCKETS,)."""
        for bucket in np.flatnonzero(counts).tolist():
            self._counts[bucket] += int(counts[bucket])
        self.count += int(counts.sum())
        self.largest_ns = max(self.largest_ns, largest_ns)

    def quantile_ns(self, share: float) -> float:
        """The duration that `share` of all do not exceed, in the middle of its bucket; NaN where there are none."""
        if self.count == 0:
            return math.nan
        wanted, seen = max(1, math.ceil(share * self.count)), 0
        for low, high, count in self.buckets():
            seen += count
            if seen >= wanted:
                return min(0.5 * (low + high), float(self.largest_ns))
        raise AssertionError("the counts do not add up to the count")

    def share_above(self, duration_ns: float) -> float:
        """Share of the durations in buckets beyond the one that `duration_ns` falls into; NaN of none."""
        above = sum(count for low, _, count in self.buckets() if low > duration_ns)
        return above / self.count if self.count else math.nan

    def buckets(self) -> Iterator[Bucket]:
        """Those that are not empty, in rising order."""
        for bucket in np.flatnonzero(self._counts).tolist():
            yield Bucket(*bounds_ns(bucket), self._counts[bucket])

    def summary_us(self) -> dict[str, float]:
        """p50, p99, p99.9 and the largest [us]; NaN (null in JSON) where nothing was timed."""
        found = {name: 1e-3 * self.quantile_ns(share) for name, share in QUANTILES.items()}
        return {**found, "max": 1e-3 * self.largest_ns if self.count else math.nan}

    def decades_us(self) -> dict[str, list[float]]:
        """Counts between 1, 2, 5, 10 ... us: `at_most` [us] and `count`, from the first that is not empty."""
        if self.count == 0:
            return {"at_most": [], "count": []}
        edges = [step * 10.0**power for power in range(-2, 10) for step in DECADE]
        counts = [0] * len(edges)
        for low, high, count in self.buckets():
            middle_us = 0.5e-3 * (low + high)
            counts[min(sum(edge < middle_us for edge in edges), len(edges) - 1)] += count
        used = np.flatnonzero(counts)
        first, last = int(used[0]), int(used[-1]) + 1
        return {"at_most": edges[first:last], "count": [float(count) for count in counts[first:last]]}
