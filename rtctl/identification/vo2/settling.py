"""Whether the holds of staircases were long enough for the device, and how long they have to be."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.identification.vo2.staircase import estimate_unsettled_share, find_hold_ends
from rtctl.measured.dataset import Dataset, Record
from rtctl.models.vo2 import Vo2Model

STILL_MOVING = 0.02
"""Largest share of a step that the last sample of a hold may bring, or that may still be to come after it.

The share of a first-order heating is known (up to 1.3 % on the bundled devices), the one of a delay is not.
"""
USELESS_TO_COME = 0.1
"""Share of a step still to come after a hold, above which the loops are not to be used."""
USELESS_LAST_SAMPLE = 0.05
"""Share of a step that the last sample of a hold brings, above which the same holds."""
SETTLING_TIME_CONSTANTS = 6.0
"""Time constants after which 0.25 % of a step is still to come."""
LONGER = 5.0
"""Times the hold that is advised where it is too short for an estimate of the time constant to be relied on."""
UNSETTLED = (
    "the holds of record {name} ({hold}) end before the device has settled: {found}. The loops identified from it are "
    "off by as much; {advice}"
)
LONGER_HOLDS = "hold at least {needed}, with rtctl acquire by {option}, until this note does not appear"
OF_OTHERS = (
    'measure it again with holds of {needed} or more; if it is no quasi-static staircase, give it use = "fit"'
)
ALL_AT_ONCE = (
    "these holds in one command: rtctl acquire acquire_vo2 {}, and --set driver... as for these data"
)


class Settling(NamedTuple):
    """How far a staircase had settled at the ends of its holds."""

    hold_s: float
    """Median length of its holds [s]."""
    last_sample: float
    """Share of a step that the last sample of a hold brings; NaN where holds have fewer than four samples."""
    to_come: float
    """Share of a step that a first-order heating brings after a hold; NaN where its time constant is not known."""
    needed_s: float
    """Length of a hold that would do [s]."""

    @property
    def is_short(self) -> bool:
        """Whether a user has to know."""
        return self.last_sample > STILL_MOVING or self.to_come > STILL_MOVING

    @property
    def is_useless(self) -> bool:
        """Whether loops from it are not to be used."""
        return self.last_sample > USELESS_LAST_SAMPLE or self.to_come > USELESS_TO_COME


def assess_settling(record: Record, time_constant_s: float, time_constant_error_s: float) -> Settling:
    """Return how far a staircase had settled.

    Args:
        record: Record with a hold for each level.
        time_constant_s: Identified time constant of the heating [s].
        time_constant_error_s: Its standard error [s]; infinite where it was not identified.
    """
    ends = find_hold_ends(record.signals["current"])
    hold_s = float(np.median(np.diff(ends, prepend=-1))) * record.period_s
    last = estimate_unsettled_share(record)
    known = math.isfinite(time_constant_error_s) and hold_s > record.period_s
    to_come = math.exp(-hold_s / time_constant_s) if known else math.nan
    needed = [SETTLING_TIME_CONSTANTS * time_constant_s if known else 0.0]
    if last > STILL_MOVING:
        needed.append(LONGER * hold_s)
    return Settling(hold_s, last, to_come, max(needed))


def assess_staircases(model: Vo2Model, dataset: Dataset) -> list[tuple[Record, Settling]]:
    """Return the staircases from which a model was identified, and how far each had settled."""
    return [
        (record, assess_settling(record, model.time_constant_s, model.time_constant_error_s))
        for record in dataset.used_for("identify")
    ]


def describe_settling(record: Record, settling: Settling) -> str:
    """Return a sentence that says what to do about holds that are too short."""
    by_sample = settling.last_sample > STILL_MOVING
    found = (
        f"the last sample still brings {settling.last_sample:.1%} of a step"
        if by_sample
        else f"{settling.to_come:.1%} of a step are still to come"
    )
    return UNSETTLED.format(
        name=record.name,
        hold=_duration(settling.hold_s),
        found=found,
        advice=_advice(record, settling),
    )


def describe_holds(settled: Sequence[tuple[Record, Settling]]) -> list[str]:
    """Return a sentence for each staircase whose holds are too short, and the one command for several acquired ones."""
    short = [(record, one) for record, one in settled if one.is_short]
    notes = [describe_settling(record, one) for record, one in short]
    acquired = [_option(record, one) for record, one in short if _excitation_number(record) is not None]
    if len(acquired) > 1:
        notes.append(ALL_AT_ONCE.format(" ".join(acquired)))
    return notes


def _advice(record: Record, settling: Settling) -> str:
    """Return what to do: the option of `rtctl acquire` only where it made the record."""
    if _excitation_number(record) is None:
        return OF_OTHERS.format(needed=_needed(settling))
    return LONGER_HOLDS.format(needed=_needed(settling), option=_option(record, settling))


def _excitation_number(record: Record) -> int | None:
    """Return the number of the excitation of which `rtctl acquire` made a record; None: it did not make it."""
    number = re.match(r"r(\d+)-", record.name)
    return int(number.group(1)) if number and "excitation" in record.conditions else None


def _option(record: Record, settling: Settling) -> str:
    """Return the option of `rtctl acquire` that makes the holds of a record as long as needed."""
    return f'--set "excitation.{_excitation_number(record)}.hold={_needed(settling)}"'


def _needed(settling: Settling) -> str:
    return _duration(_rounded_up(settling.needed_s))


def _rounded_up(value: float) -> float:
    """Return `value` with two digits, not smaller."""
    unit: float = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / unit - 1e-9) * unit


def _duration(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms"
