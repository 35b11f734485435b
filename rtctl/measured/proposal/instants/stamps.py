"""Whether the stamps of a time column are uniform, rounded ones of a uniform clock, or uneven."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.columns.time_axis import ON_LINE, line_through, uniform_period
from rtctl.measured.proposal.instants.column_time import read_time
from rtctl.measured.proposal.proposal import TimeGuess
from rtctl.measured.proposal.survey import Survey

LOST_ROW = 1.5
"""Step, over the usual one, from which on rows are missing."""


class Stamps(NamedTuple):
    """What the stamps of a file are."""

    uneven: str = ""
    """Why they are to be resampled; "": they are not."""
    rounded: str = ""
    """Why the rate of a line through them is taken; "": they are uniform as they stand, or uneven."""
    rate_hz: float | None = None
    """Rate of the line through the longest part."""


def judge_stamps(survey: Survey, parts: Sequence[tuple[int, int]], time: TimeGuess) -> Stamps:
    """Return what the stamps of the parts [first, end) of a file are. Raises ValueError where time goes back."""
    if time.column is None:
        return Stamps()
    stamps = read_time(survey.columns[time.column], time.unit)
    pieces = [stamps.time_s[first:end] for first, end in parts]
    if all(
        _is_uniform(piece, time.column, part[0], stamps.resolution_s)
        for piece, part in zip(pieces, parts, strict=True)
    ):
        return Stamps(rate_hz=line_through(max(pieces, key=len), lacks_none=True).rate_hz)
    lines = [line_through(piece) for piece in pieces]
    worst, missing = max(line.off for line in lines), sum(line.missing for line in lines)
    if worst <= ON_LINE and not missing:
        return Stamps(
            rounded=f"its rounded stamps lie within {100.0 * worst:.2g} % of a step on a line",
            rate_hz=lines[int(np.argmax([len(piece) for piece in pieces]))].rate_hz,
        )
    steps = np.concatenate([np.diff(piece) for piece in pieces])
    usual = float(np.median(steps))
    off = 100.0 * float(np.abs(steps - usual).max()) / usual
    lost = [
        (first + int(row), round(float(step) / usual) - 1)
        for piece, (first, _) in zip(pieces, parts, strict=True)
        for row, step in enumerate(np.diff(piece), 1)
        if step > LOST_ROW * usual
    ]
    missing = sum(count for _, count in lost)
    where = (
        f"; {missing} {'row is' if missing == 1 else 'rows are'} missing, first before row {lost[0][0]}"
        if lost
        else ""
    )
    if worst <= ON_LINE:
        usual = lines[int(np.argmax([len(piece) for piece in pieces]))].period_s
    return Stamps(uneven=f"its steps differ by up to {off:.3g} % from {usual:.6g} s{where}")


def _is_uniform(piece: FloatArray, name: str, first: int, resolution_s: float) -> bool:
    """Return whether a reader takes the stamps as uniform. Raises ValueError where they go back."""
    goes_back = bool(np.any(np.diff(piece) <= 0.0))
    try:
        uniform_period(piece, name, first, resolution_s)
    except ValueError:
        if goes_back:
            raise
        return False
    return True
