"""Columns that may be signals: what their names and units say, and for which signal of a plant they speak."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.proposal.naming.column_names import STRONG, read_name
from rtctl.measured.proposal.naming.column_units import (
    Reading,
    Unit,
    quantity_of,
    read_column,
    told_logarithm,
)
from rtctl.measured.proposal.survey import Survey
from rtctl.registry import SignalKind

QUANTITIES = {
    "drive": {"drive": 1.0, "current": 0.9},
    "displacement": {"displacement": 1.0, "deflection": 0.95},
    "velocity": {"velocity": 1.0},
    "acceleration": {"acceleration": 1.0},
    "current": {"current": 1.0, "drive": 0.5},
    "resistance": {"resistance": 1.0},
    "deflection": {"deflection": 1.0, "displacement": 0.9},
}
"""Quantities that a signal may be called, with the weight of their votes."""
EXACT = 8.0
"""Vote of a column that has the signal's own name."""
SINGLE = "a single number"
FEWEST_COUNTED, MOST_LOST = 10, 0.05
"""Rows of a column that counts them, least, and the share of its steps that may be longer than one."""
NOT_SIGNALS = ("time", "index", "rate", "period", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A column of numbers that varies."""

    name: str
    label: str
    """Words that tell what it is: its name, perhaps with that of its group."""
    reading: Reading
    values: FloatArray
    """Numbers of the first file in which it varies."""

    @property
    def unit(self) -> Unit:
        """Unit, with who states it."""
        return self.reading.unit

    @property
    def named(self) -> dict[str, float]:
        """Votes of the name alone."""
        return read_name(self.label).votes

    def score(self, signal: str, kind: SignalKind) -> float:
        """Return how much speaks for this column as a signal."""
        votes = self.reading.votes
        own = EXACT if self.label.strip().lower() == signal else 0.0
        weights = QUANTITIES.get(signal, {})
        if signal == "current" and self.unit.text and quantity_of(self.unit.text) != "current":
            return own
        if (
            kind.role == "output"
            and kind.unit
            and self.unit.text
            and not _measures(self.unit.text, kind.unit)
        ):
            return own
        return own + max(
            (weight * votes.get(quantity, 0.0) for quantity, weight in weights.items()), default=0.0
        )

    def best(self, kinds: Mapping[str, SignalKind]) -> str:
        """Return the signal for which most speaks; "": none, or two alike, or something that is no signal."""
        scores = {signal: self.score(signal, kind) for signal, kind in kinds.items()}
        first, *rest = sorted(scores.values(), reverse=True) or [0.0]
        other = max((self.reading.votes.get(one, 0.0) for one in NOT_SIGNALS), default=0.0)
        if first <= 0.0 or (rest and rest[0] == first) or other > first:
            return ""
        return max(scores, key=lambda one: scores[one])

    @property
    def is_no_signal(self) -> bool:
        """Return whether its name says something that is no signal of any plant."""
        return any(self.reading.votes.get(one, 0.0) >= STRONG for one in NOT_SIGNALS)


def find_candidates(
    surveys: Sequence[Survey], without: Sequence[str | None], *, named_logarithms: bool = False
) -> tuple[dict[str, Candidate], dict[str, str]]:
    """Return the columns that may be signals, and the others with the reason.

    Args:
        surveys: The files; a column must be in all of them.
        without: Columns that are the time.
        named_logarithms: Whether a column whose name says that it is a logarithm may be a signal, as of equations.
    """
    found: dict[str, Candidate] = {}
    others: dict[str, str] = {}
    for name, first in surveys[0].columns.items():
        columns = [survey.columns[name] for survey in surveys if name in survey.columns]
        if name in without:
            continue
        if first.values is None:
            others[name] = first.refusal
        elif any(name not in survey.numeric for survey in surveys if name in survey.columns):
            others[name] = SINGLE if first.rows == 1 else f"{first.rows} of {surveys[0].rows} rows"
        elif len(columns) < len(surveys):
            others[name] = "not in every file"
        elif not any(column.varies for column in columns):
            others[name] = f"constant, {first.values[0] + 0.0:.6g} throughout"
        elif is_count(first.values):
            others[name] = "counts the rows"
        elif logarithm := told_logarithm(first, named=not named_logarithms):
            others[name] = logarithm
        else:
            values = next(column.values for column in columns if column.varies and column.values is not None)
            found[name] = Candidate(
                name=name, label=first.label or name, reading=read_column(first), values=values
            )
    for name in [one for one in found if surveys[0].columns[one].alias_of in found]:
        other = surveys[0].columns[name].alias_of
        less, more = (name, other) if found[other].reading.votes else (other, name)
        others[less] = f'another name of "{more}"'
        del found[less]
    return found, others


def find_silent(surveys: Sequence[Survey], without: Sequence[str | None]) -> dict[str, Candidate]:
    """Return the columns that are 0 throughout in every file, as candidates; the arguments are the same."""
    return {
        name: Candidate(name=name, label=first.label or name, reading=read_column(first), values=first.values)
        for name, first in surveys[0].columns.items()
        if name not in without
        and first.values is not None
        and all(name in one.numeric and not np.any(one.columns[name].values) for one in surveys)
    }


def is_count(values: FloatArray) -> bool:
    """Return whether numbers (n,) are 0, 1, 2, ... or 1, 2, 3, ..."""
    return len(values) > 2 and values[0] in (0.0, 1.0) and bool(np.all(np.diff(values) == 1.0))


def lost_counts(values: FloatArray) -> tuple[int, int]:
    """Return how many numbers a column (n,) that counts its rows misses, and before which row first; 0: none."""
    steps = np.diff(values)
    if len(values) < FEWEST_COUNTED or not (steps == np.round(steps)).all() or values[0] != round(values[0]):
        return 0, 0
    jumps = np.flatnonzero(steps != 1.0)
    if not len(jumps) or len(jumps) > MOST_LOST * len(steps) or (steps[jumps] < 1.0).any():
        return 0, 0
    return int(np.sum(steps[jumps] - 1.0)), int(jumps[0]) + 1


def _measures(unit: str, like: str) -> bool:
    from rtctl.measured.units import check_unit

    try:
        check_unit(unit, like)
    except ValueError:
        return False
    return True
