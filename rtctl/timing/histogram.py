"""Histograms of durations in constant memory: buckets that grow with the value, as HdrHistogram has them.

A value of b bits beyond `BITS` keeps its leading `BITS` ones: 64 buckets an octave, so a quantile is off by at most
1/128 of itself, from 1 ns to 18 minutes, in 2,304 counters.
Reference: G. Tene, HdrHistogram (log-linear buckets).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import IntArray
from rtctl.border.kernels import kernel

BITS = 7
_HALF = 1 << (BITS - 1)
_OCTAVES = 34
BUCKETS = (_OCTAVES + 1) * _HALF + _HALF
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99_9": 0.999}
DECADE = (1.0, 2.0, 5.0)


class Bucket(NamedTuple):
    """A bucket: durations from `low_ns` to `high_ns` (both included), and how many there were."""

    low_ns: int
    high_ns: int
    durations: int


def bounds_ns(bucket: int) -> tuple[int, int]:
    """Return the least and the largest duration [ns] that falls into a bucket."""
    if bucket < 2 * _HALF:
        return bucket, bucket
    shift = bucket // _HALF - 1
    low = (bucket - shift * _HALF) << shift
    return low, low + (1 << shift) - 1


@kernel
def bucket_of(duration_ns: int) -> int:
    """Return the bucket of a duration [ns] >= 0; durations above 18 minutes share the highest one."""
    shift, rest = 0, duration_ns >> BITS
    while rest > 0:
        rest >>= 1
        shift += 1
    bucket = duration_ns if shift == 0 else (shift << (BITS - 1)) + (duration_ns >> shift)
    return min(bucket, BUCKETS - 1)


@kernel
def count_duration(counts: IntArray, row: int, duration_ns: int) -> None:
    """Count one duration [ns] in `counts[row]`, an array of `BUCKETS` counts and the largest duration.

    A negative duration counts as 0 ns.
    """
    duration_ns = max(duration_ns, 0)
    counts[row, bucket_of(duration_ns)] += 1
    counts[row, BUCKETS] = max(counts[row, BUCKETS], duration_ns)


class Histogram:
    """A histogram of durations [ns]."""

    __slots__ = ("_counts",)

    def __init__(self, counts: IntArray | None = None) -> None:
        """Count into `counts` (1, BUCKETS + 1), which a kernel may share (`count_duration`); None: into its own."""
        self._counts = np.zeros((1, BUCKETS + 1), dtype=np.int64) if counts is None else counts

    @property
    def count(self) -> int:
        """How many durations were recorded."""
        return int(self._counts[0, :BUCKETS].sum())

    @property
    def largest_ns(self) -> int:
        """The largest duration [ns]; 0 if there was none."""
        return int(self._counts[0, BUCKETS])

    def record(self, duration_ns: int) -> None:
        """Count one duration [ns]; below 0 as 0, above 18 minutes in the highest bucket."""
        count_duration(self._counts, 0, duration_ns)

    def record_many(self, duration_ns: int, times: int) -> None:
        """Count the same duration [ns] `times` times; 0 times changes nothing."""
        if times > 0:
            self._counts[0, bucket_of(duration_ns)] += times
            self._counts[0, BUCKETS] = max(self.largest_ns, duration_ns)

    def quantile_ns(self, share: float) -> float:
        """Return the duration [ns] that `share` of all do not exceed, as the middle of its bucket; NaN if none."""
        total = self.count
        if total == 0:
            return math.nan
        wanted, seen = max(1, math.ceil(share * total)), 0
        for low, high, count in self.buckets():
            seen += count
            if seen >= wanted:
                return min(0.5 * (low + high), float(self.largest_ns))
        raise AssertionError("the counts do not add up to the count")

    def buckets(self) -> Iterator[Bucket]:
        """Yield the buckets that are not empty, in rising order."""
        counts = self._counts[0, :BUCKETS]
        for bucket in np.flatnonzero(counts).tolist():
            yield Bucket(*bounds_ns(bucket), int(counts[bucket]))

    def summary_us(self) -> dict[str, float]:
        """Return p50, p99, p99.9 and the largest duration [us]; NaN (null in JSON) if nothing was timed."""
        quantiles_us = {name: 1e-3 * self.quantile_ns(share) for name, share in QUANTILES.items()}
        return {**quantiles_us, "max": 1e-3 * self.largest_ns if self.count else math.nan}

    def decades_us(self) -> dict[str, list[float]]:
        """Return counts between 1, 2, 5, 10 ... us: `at_most` [us] and `count`, from the first that is not empty."""
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
