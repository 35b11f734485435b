"""Which records of held levels are quasi-static staircases: by their names, else by what identification needs of them.

The static loops are identified from steady states all through the transition: from small steps, each of which is over
before the next one. Large steps show the heating on its way, and a record whose holds end before that is over has no
steady states: those are for fits and tests.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.proposal.survey import Survey

FEWEST_LEVELS, FEWEST_ROWS = 20, 3
"""Fewest levels, and rows of a level, of a staircase."""
STILL_TO_COME = 0.02
"""Share of a step after a hold from which `rtctl identify` says that the hold is too short."""
SMALL_STEP = 0.125
"""Median step, as a share of the range, up to which a staircase follows the loops; independent levels have 0.3."""
THROUGH = 0.5
"""Share of the widest swing of ln R from which a staircase goes through the transition as well."""
_TEST_NAME = re.compile(r"(?:^|[^a-z])(test|val|valid|validation|holdout)(?:[^a-z]|$)", re.IGNORECASE)
_FIT_NAME = re.compile(r"(?:^|[^a-z])(fit|train|training)(?:[^a-z]|$)", re.IGNORECASE)
_IDENTIFY_NAME = re.compile(
    r"(?:^|[^a-z])(identify|identification|quasi[-_ ]?static)(?:[^a-z]|$)", re.IGNORECASE
)
BY_NAME = "its name says so"


class Staircase(NamedTuple):
    """What a record of held levels shows."""

    rows: int
    """Median length of its holds [rows]."""
    step: float
    """Median step of the current, as a share of the record's range."""
    to_come: float
    """Share of a step of ln R that is still to come after a hold, of a first-order settling; 1 where none is seen."""
    swing: float
    """Range of ln R at the ends of the holds."""

    @property
    def is_settled(self) -> bool:
        """Whether the ends of its holds are steady states."""
        return self.to_come <= STILL_TO_COME


class Use(NamedTuple):
    """Use of a record, with the reason."""

    use: str
    why: str


def says_test(name: str) -> bool:
    """Return whether a record is called a test."""
    return _TEST_NAME.search(name) is not None


def look_at_staircase(survey: Survey, current: str, resistance: str | None) -> Staircase | None:
    """Return what a file shows if its current is held at many levels; None: it is not.

    Args:
        survey: The file.
        current: Column of the current.
        resistance: Column of the resistance, if there is one.
    """
    levels = survey.columns[current].values if current in survey.columns else None
    if levels is None or len(levels) < 2:
        return None
    changes = np.flatnonzero(np.diff(levels))
    if len(changes) < FEWEST_LEVELS or float(np.median(np.diff(changes))) < FEWEST_ROWS:
        return None
    column = survey.columns.get(resistance or "")
    readings = np.full(len(levels), np.nan) if column is None or column.values is None else column.values
    return measure_staircase(levels, readings)


def measure_staircase(current: FloatArray, resistance: FloatArray) -> Staircase:
    """Return steps, settling and swing of a staircase.

    The settling is that of the mean of ln R over the steps, weighted by the step of the current that caused it, which
    shares no noise with the readings. What the second half of a hold brings is r times what the first half brings; r^2
    of the step is then to come.

    Args:
        current: Held levels (n,).
        resistance: Readings (n,), the first of a hold at the earliest when its current begins to act.
    """
    first = np.flatnonzero(np.diff(current)) + 1
    lengths = np.diff(np.append(first, len(current)))
    rows = int(np.median(lengths[:-1]))
    jump = current[first] - current[first - 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        log_r = np.log(np.abs(resistance))
    whole, half = lengths >= rows, (rows - 1) // 2
    begin, middle, end = (log_r[first[whole] + k * half] for k in range(3))
    seen = np.isfinite(begin + middle + end)
    weight = jump[whole][seen]
    earlier, later = ((b - a)[seen] @ weight for a, b in ((begin, middle), (middle, end)))
    ratio = later / earlier if earlier != 0.0 else 1.0
    ends = log_r[first - 1][np.isfinite(log_r[first - 1])]
    return Staircase(
        rows,
        float(np.median(np.abs(jump))) / float(np.ptp(current)),
        float(np.clip(ratio, 0.0, 1.0)) ** 2,
        float(np.ptp(ends)) if len(ends) else 0.0,
    )


def propose_uses(staircases: Sequence[Staircase | None], names: Sequence[str]) -> list[Use]:
    """Return what each record is for, "identify" or "fit"; which of the latter are tests is chosen among all kinds.

    A name decides first. Where no name says so and no record has what identification needs, the unnamed one that comes
    nearest is taken for it.

    Args:
        staircases: What each file shows; None of those that are no staircase.
        names: How each is called.
    """
    found = [_by_name(name, alone=len(names) == 1) for name in names]
    widest = max((one.swing for one in staircases if one), default=0.0)
    uses = [named or _by_readings(one, widest) for named, one in zip(found, staircases, strict=True)]
    free = [
        (one.is_settled, one.swing >= THROUGH * widest, one.rows, -one.to_come, -k)
        for k, one in enumerate(staircases)
        if one and found[k] is None
    ]
    if free and not any(one.use == "identify" for one in uses):
        *_, nearest = max(free)
        why = (
            "of these records it is nearest to a quasi-static staircase" if len(names) > 1 else "a staircase"
        )
        uses[-nearest] = Use("identify", f"{why}, though {uses[-nearest].why}")
    return uses


def _by_name(name: str, *, alone: bool) -> Use | None:
    if not alone and (says_test(name) or _FIT_NAME.search(name)):
        return Use("fit", BY_NAME)
    return Use("identify", BY_NAME) if _IDENTIFY_NAME.search(name) else None


def _by_readings(one: Staircase | None, widest: float) -> Use:
    if one is None:
        return Use("fit", "")
    if not one.is_settled:
        return Use("fit", f"{one.to_come:.0%} of a step are still to come after its holds of {one.rows} rows")
    if one.step > SMALL_STEP:
        return Use("fit", f"its steps are large, {one.step:.0%} of the range in the median")
    if one.swing < THROUGH * widest:
        return Use("fit", "it does not go all through the transition")
    return Use(
        "identify",
        "a quasi-static staircase: small steps, each over before the next, all through the transition",
    )


def doubts_about_uses(records: Sequence[tuple[str, Use]], *, tested: bool) -> list[str]:
    """Return what should be looked at: which records are for what and why, and which use no record has.

    Args:
        records: Name and use of each record of a vo2.
        tested: Whether a test is wanted.
    """
    reasons: dict[Use, list[str]] = {}
    for name, use in records:
        reasons.setdefault(use, []).append(name)
    told = [
        f"{one.use}: {', '.join(names)}{f' ({one.why})' if one.why else ''}" for one, names in reasons.items()
    ]
    doubts = [f"what the records are for: {'; '.join(told)}"] if len(records) > 1 else []
    missing = [
        use for use in ("fit", "test") if use not in {one.use for one in reasons} and (use == "fit" or tested)
    ]
    if missing:
        doubts.append(
            f"no record is left for {' and '.join(missing)}: rtctl diagnose has little to judge by; correct `use`, or "
            "measure fast steps as well"
        )
    return doubts
