"""A record with what a model before and after its extension makes of it: the data of several figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class BeforeAfter:
    """One record, scored samples (n,), in the data's units; NaN from where a model diverged."""

    record: str
    output: str
    unit: str
    time_s: FloatArray
    """Time (n,) from the record's beginning [s]."""
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    output_rate: FloatArray
    """Rate of `after` [unit/s]."""
    rate: float
    """Dominant angular frequency [1/s]."""
    starts: tuple[int, ...] = (0,)
    """First sample of each piece of the record: free runs begin anew there, from the piece's own initial state."""

    @property
    def period_s(self) -> float:
        """Sample period [s]."""
        return float(self.time_s[1] - self.time_s[0])

    @property
    def errors(self) -> tuple[FloatArray, FloatArray]:
        """Return simulated minus measured, before and after; 0 where a model diverged."""
        return np.nan_to_num(self.before - self.measured), np.nan_to_num(self.after - self.measured)

    @property
    def pieces(self) -> list[slice]:
        """Return the samples of each piece."""
        ends = (*self.starts[1:], len(self.time_s))
        return [slice(first, end) for first, end in zip(self.starts, ends, strict=True)]

    def with_gaps(self, values: FloatArray) -> FloatArray:
        """Return `values` (n,) with NaN at the last sample of each piece, so that no line crosses to the next."""
        broken = values.astype(np.float64, copy=True)
        broken[np.array(self.starts[1:], dtype=np.intp) - 1] = np.nan
        return broken


def join_pieces(pieces: list[BeforeAfter]) -> BeforeAfter:
    """Return the pieces of one record as one, in the order of time."""
    ordered = sorted(pieces, key=lambda one: float(one.time_s[0]))
    first = ordered[0]
    starts = np.concatenate(([0], np.cumsum([len(one.time_s) for one in ordered])[:-1]))

    def joined(name: str) -> FloatArray:
        values: FloatArray = np.concatenate([getattr(one, name) for one in ordered])
        return values

    return BeforeAfter(
        record=first.record, output=first.output, unit=first.unit, rate=first.rate,
        time_s=joined("time_s"), measured=joined("measured"), before=joined("before"), after=joined("after"),
        output_rate=joined("output_rate"), starts=tuple(int(one) for one in starts),
    )  # fmt: skip
