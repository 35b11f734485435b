"""What a screening step takes and returns: the records that may be used, and the notes on those that may not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import Record


class Kept(NamedTuple):
    """Records of a dataset after a check, and its notes."""

    records: Sequence[Record]
    notes: Sequence[str]


class Screened(NamedTuple):
    """Records to fit and records to test on after a check, and its notes."""

    fit: tuple[FitRecord, ...]
    tests: tuple[FitRecord, ...]
    notes: tuple[str, ...] = ()


RecordCheck = Callable[[Sequence[Record]], Kept]
ScreeningStep = Callable[[Screened], Screened]


def apply_checks(records: Sequence[Record], checks: Sequence[RecordCheck]) -> Kept:
    """Apply `checks` one after the other and collect their notes."""
    notes: list[str] = []
    for check in checks:
        records, said = check(records)
        notes += said
    return Kept(records, notes)


def apply_steps(screened: Screened, steps: Sequence[ScreeningStep]) -> Screened:
    """Apply `steps` one after the other; the notes of each follow those before."""
    for step in steps:
        after = step(screened._replace(notes=()))
        screened = after._replace(notes=(*screened.notes, *after.notes))
    return screened
