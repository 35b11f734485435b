"""Any range of a recording in as many points as a screen has: extremes of bins for charts, samples for planes."""

from __future__ import annotations

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.live_page.recorded.decimation import Pyramid
from rtctl.live_page.recorded.followed import FollowedRun
from rtctl.live_page.recorded.rows import INDEX
from rtctl.live_page.served.packing import packed
from rtctl.live_page.shown.description import Description, description_of

MOST_BINS = 4000
PLANE_POINTS = 1500
RUNS_KEPT = 4
"""Recordings whose blocks are kept in memory."""


class _Kept(NamedTuple):
    followed: FollowedRun
    description: Description
    pyramid: Pyramid


class History:
    """Ranges of the recordings of one folder, for all viewers."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._kept: OrderedDict[str, _Kept] = OrderedDict()
        self._lock = threading.Lock()

    def range(self, name: str, from_s: float, to_s: float, bins: int) -> dict[str, Any]:
        """Return the signals from `from_s` to `to_s` in at most `bins` bins.

        Args:
            name: name of the run or record; "": the newest.
            from_s: begin [s]; -inf: that of the recording.
            to_s: end [s]; inf: that of the recording.
            bins: at most so many bins; fewer rows than that come as they are.

        Raises:
            InputError: nothing is recorded under this name, or a number is out of range.
        """
        if not 1 <= bins <= MOST_BINS:
            raise InputError(f"points = {bins}: 1 to {MOST_BINS} are given at a time")
        if not from_s <= to_s:
            raise InputError(f"from = {from_s:g} s, to = {to_s:g} s: a range begins before it ends")
        with self._lock:
            kept = self._opened(name)
            count = kept.description.rows.count()
            return _range(kept.description, kept.pyramid, count, (from_s, to_s), bins)

    def _opened(self, name: str) -> _Kept:
        kept = self._kept.get(name)
        followed = FollowedRun(self._folder, name) if kept is None else kept.followed
        changed = followed.look()
        if followed.rows is None or followed.place is None:
            raise InputError(f'nothing is recorded under "{name}" in {self._folder}')
        if kept is None or changed:
            description = description_of(followed.rows, followed.place)
            kept = _Kept(followed, description, Pyramid(len(description.shown.signals) + 1))
        elif kept.description.rows is not followed.rows:  # the same rows, by now in another file
            kept = kept._replace(description=description_of(followed.rows, followed.place))
        self._kept[name] = kept
        self._kept.move_to_end(name)
        if len(self._kept) > RUNS_KEPT:
            self._kept.popitem(last=False)[1].followed.close()
        return kept


def _range(
    description: Description, pyramid: Pyramid, count: int, span_s: tuple[float, float], bins: int
) -> dict[str, Any]:
    def read(first: int, last: int) -> FloatArray:
        return _with_samples(description, first, last)

    pyramid.extend(count, read)
    first = 0 if span_s[0] == -np.inf else description.row_at(span_s[0], count)
    last = count if span_s[1] == np.inf else min(description.row_at(span_s[1], count) + 1, count)
    found = pyramid.range(first, last, bins, read)
    step = max(-(-(last - first) // PLANE_POINTS), 1)
    return {
        "key": description.rows.key,
        "rows": count,
        "end_s": description.time_s(count - 1),
        "first": first + 1,
        "last": last,
        "exact": len(found.first) == last - first,
        "time_s": packed(description.period_s * found.low[-1], "<f8"),
        "low": packed(found.low[:-1]),
        "high": packed(found.high[:-1]),
        "plane_step": step,
        "plane": packed(_strided(description, first, last, step)),
    }


def _with_samples(description: Description, first: int, last: int) -> FloatArray:
    """Return the signals of rows and below them the numbers of their samples (signals + 1, rows)."""
    table = description.rows.read(first, last)
    samples = table[INDEX] if INDEX in table else np.arange(first, last, dtype=np.float64)
    return np.vstack([description.shown.matrix(table), samples])


def _strided(description: Description, first: int, last: int, step: int) -> FloatArray:
    """Return every `step`-th row of a range (signals, rows)."""
    if step == 1:
        return description.matrix(first, last)
    rows = [description.matrix(row, row + 1) for row in range(first, last, step)]
    return np.concatenate(rows, axis=1) if rows else np.zeros((len(description.shown.signals), 0))
