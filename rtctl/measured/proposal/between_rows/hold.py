"""How the drive goes on between its rows: by the user's word, by what the file says, or by how it changes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.measured.proposal.between_rows.told_hold import told_hold
from rtctl.measured.proposal.naming.own_recording import is_own_recording, is_own_run

HOLDS = ("linear", "zero", "band-limited")
HELD_SHARE = 0.5
"""Share of rows that repeat the one before, from which an input is taken as held between its samples."""
FAST, TAPS = 0.8, 63
"""Share of half the sample rate from which a change is fast, and the rows of the filter that sees it."""
LEAST_FAST = 0.05
"""Largest fast part over the RMS of an input that its rows show whole: above it there are steps, or loud noise."""
SAID = "you said so"
LATER = "If a converter holds each value, say --hold zero, or the model is off by half a sample of delay"
UNSEEN = (
    '{name}: it changes from row to row, so its rows do not show how it goes on between them: hold = "linear" '
    f"(straight lines) is taken. {LATER}. If it was measured behind an anti-aliasing filter, --hold band-limited is "
    "closer"
)
SMOOTH = (
    '{name}: it changes from row to row, and nothing of it near half the sample rate: hold = "band-limited" (the '
    f"smooth curve through its rows) is taken. {LATER}"
)
COMMAND = re.compile(
    r"(?:^|[\W_])(?:cmd|command(?:ed)?|set_?point|sollwert|stellgr(?:ö|oe)(?:ß|ss)e|consigne|mando|dac|ao)\d*(?=$|[\W_])",
    re.IGNORECASE,
)
"""Names of a number that a converter puts out, and holds until the next one."""
CALLED_COMMAND = (
    '{name}: its column "{column}" is called a command, which a converter holds until the next one: hold = "zero" is '
    "taken; where it was measured, say --hold linear, or the model is off by half a sample"
)
READ_AT_THE_END = (
    "{name}: a recorded run. In lockstep its readings belong to the end of their row's period, one row earlier than "
    "those of a dataset: a timing.skew of one period means that, and no fault. rtctl acquire writes them at their place"
)


class Hold(NamedTuple):
    """Hold of an input."""

    hold: str
    why: str
    doubts: tuple[str, ...] = ()


def find_hold(
    said: str | None, name: str, column: str, values: FloatArray | None, texts: Mapping[str, str]
) -> Hold:
    """Return the hold of an input between its samples. Raises InputError for one that is none.

    Args:
        said: The user's word.
        name: The input.
        column: Its column.
        values: Its numbers (n,).
        texts: What the file says in words, by where it stands.
    """
    where = told_hold(texts)
    if said is not None:
        if said not in HOLDS:
            raise InputError(f"--hold {said}: is none of {', '.join(HOLDS)}{nearest(said, HOLDS)}")
        contrary = f'{name}: hold = "{said}", as you said, but {where} says that a converter holds its values'
        return Hold(said, SAID, (contrary,) if where and said != "zero" else ())
    if is_own_recording(texts):
        doubts = (READ_AT_THE_END.format(name=name),) if is_own_run(texts) else ()
        return Hold("zero", "rtctl recorded it, and holds each value for one period", doubts)
    if where:
        return Hold("zero", f"by {where}", (f'{name}: hold = "zero" by {where}',))
    steps = np.diff(values) if values is not None else np.empty(0)
    if not np.any(steps):
        return Hold("linear", "it does not change")
    if np.mean(steps == 0.0) >= HELD_SHARE:
        return Hold("zero", "it stays and jumps, as the output of a converter does")
    if COMMAND.search(column):
        return Hold("zero", "its name says a command", (CALLED_COMMAND.format(name=name, column=column),))
    if values is not None and _is_smooth(values):
        return Hold("band-limited", "it is smooth, as a measured signal is", (SMOOTH.format(name=name),))
    return Hold(
        "linear", "it changes from row to row, as a measured signal does", (UNSEEN.format(name=name),)
    )


def _is_smooth(values: FloatArray) -> bool:
    """Return whether an input (n,) has no part near half the sample rate: no step, no noise beyond a few percent."""
    if len(values) < 2 * TAPS or not np.isfinite(values).all():
        return False
    from scipy.signal import fftconvolve, firwin

    fast = fftconvolve(values - np.mean(values), firwin(TAPS, FAST, pass_zero=False), mode="valid")
    return float(np.abs(fast).max()) < LEAST_FAST * float(np.std(values))
