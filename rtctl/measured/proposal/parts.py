"""Which rows of which file are a record, and which of them no fit may use."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import InputError, nearest
from rtctl.measured.columns.time_axis import LONGEST_GAP, rising
from rtctl.measured.proposal.instants.column_time import read_time
from rtctl.measured.proposal.proposal import RecordGuess, TimeGuess
from rtctl.measured.proposal.survey import Survey
from rtctl.measured.proposal.uses.staircases import BY_NAME, Use, says_test

FEWEST_ROWS = 60
"""Rows below which a file is not cut into fit and test."""
TEST_SHARE = 1.0 / 3.0
LEAST_PART = 0.05
"""Share of the longest part between gaps below which a part is left out."""
MOST_PARTS = 20
MOST_SHORT, MOST_SINGLE = 5, 3
"""Parts that may all be shorter than `FEWEST_ROWS`, and rows without numbers in a row that are single ones."""
_SHOWN = 3
_FILL = (
    "They are single rows among others: where the signals go on smoothly from row to row, write the line between the "
    "neighbours into these cells (pandas: interpolate), and the file is one record"
)
"""What to do with single rows, which would be bridged by a guess."""
LONGEST_TITLE = 60
"""Characters of a title that are shown."""
LAST_THIRD, NO_TEST = "last-third", "none"


def find_parts(survey: Survey, columns: Sequence[str], time: TimeGuess) -> tuple[list[tuple[int, int]], str]:
    """Return the runs of rows [first, end) that have all signals and no gap in time, and why they are several.

    Raises:
        ValueError: They are too many, or none is long enough.
    """
    whole = np.ones(survey.rows, dtype=bool)
    for name in columns:
        values = survey.columns[name].values
        if values is not None:
            whole &= np.isfinite(values)
    breaks = _gaps(survey, time)
    begun = {row for name in columns for row in survey.columns[name].begun} if time.column is None else set()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8)))
    runs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    parts = [part for run in runs for part in _cut(run, sorted({*breaks, *begun}))]
    if not parts:
        raise ValueError(f"no row has numbers in all of {', '.join(columns)}")
    if max(end - first for first, end in parts) < 2:
        raise ValueError(
            f"has no two rows after each other with numbers in all of {', '.join(columns)}; give the one that is "
            "measured at fewer instants a file of its own, or correct the file"
        )
    longest = max(end - first for first, end in parts)
    kept = [one for one in parts if one[1] - one[0] >= max(LEAST_PART * longest, 2)]
    lost = _lost(edges, survey.rows)
    short = len(kept) > MOST_SHORT and longest < FEWEST_ROWS
    if len(kept) > MOST_PARTS or (short and lost.are_single):
        raise ValueError(_about_many(kept, lost))
    if kept == [(0, survey.rows)]:
        return kept, ""
    why = _why_cut(survey, kept, breaks, begun, np.flatnonzero(~whole))
    return kept, f"{why}. {_FILL}" if lost.are_single else why


class _Lost(NamedTuple):
    """Rows without numbers between the parts of a file."""

    runs: tuple[tuple[int, int], ...]
    """Runs of them, [first, end) each."""
    are_single: bool
    """Whether none between two parts is longer than what a converter loses now and then."""


def _lost(edges: NDArray[np.intp], rows: int) -> _Lost:
    """Return what lies between the runs that have numbers, by their edges, in a file of `rows` rows."""
    between = np.concatenate([[0], edges, [rows]]).reshape(-1, 2)
    runs = tuple((int(first), int(end)) for first, end in between if end > first)
    inside = [end - first for first, end in runs if first > 0 and end < rows]
    return _Lost(runs, bool(inside) and max(inside) <= MOST_SINGLE)


def _about_many(kept: Sequence[tuple[int, int]], lost: _Lost) -> str:
    """Return why so many parts are no records, what to do, and where the longest are."""
    longest = sorted(kept, key=lambda one: one[0] - one[1])[:_SHOWN]
    rows = ", ".join(f"rows = [{first}, {end}]" for first, end in sorted(longest))
    count = sum(end - first for first, end in lost.runs)
    empty = f" ({count} rows without numbers, first row {lost.runs[0][0]})" if lost.runs else ""
    remedy = f". {_FILL}" if lost.are_single else "; correct the file"
    return (
        f"falls into {len(kept)} parts between gaps of time and rows without numbers{empty}{remedy}; or write the rows "
        f"that you want into a manifest, the longest are {rows}"
    )


def _why_cut(
    survey: Survey,
    kept: Sequence[tuple[int, int]],
    breaks: Mapping[int, int],
    begun: Collection[int],
    empty: NDArray[np.intp],
) -> str:
    """Return why a file falls into the parts `kept`, and what is not in them."""
    lost = survey.rows - sum(end - first for first, end in kept)
    reasons = []
    if breaks:
        several = f"{len(breaks)} gaps" if len(breaks) > 1 else "a gap"
        reasons.append(
            f"{several} in time, where about {sum(breaks.values())} rows are missing (the first after row "
            f"{min(breaks) - 1})"
        )
    if begun:
        reasons.append(f"{len(begun) + 1} acquisitions in one file, with a pause before row {min(begun)}")
    if len(empty):
        reasons.append(f"rows without numbers, first row {empty[0]}")
    left_out = f", {lost} {'row' if lost == 1 else 'rows'} left out" if lost or not (breaks or begun) else ""
    where = ", ".join(f"[{first}, {end}]" for first, end in kept[:_SHOWN]) + ", ..." * (len(kept) > _SHOWN)
    return f"{' and '.join(reasons)}: {len(kept)} {'part' if len(kept) == 1 else 'parts'}, rows {where}{left_out}"


def _gaps(survey: Survey, time: TimeGuess) -> dict[int, int]:
    """Return the rows before which the time jumps over more than resampling bridges, with the rows that it skips."""
    if time.column is None:
        return {}
    steps = rising(read_time(survey.columns[time.column], time.unit).time_s, time.column, 0)
    usual = float(np.median(steps))
    jumps = np.flatnonzero(steps > LONGEST_GAP * usual)
    return {int(row) + 1: round(float(steps[row]) / usual) - 1 for row in jumps}


def _cut(run: tuple[int, int], breaks: Iterable[int]) -> list[tuple[int, int]]:
    edges = [run[0], *(row for row in breaks if run[0] < row < run[1]), run[1]]
    return list(zip(edges[:-1], edges[1:], strict=True))


def propose_records(
    surveys: Sequence[Survey],
    parts: Sequence[list[tuple[int, int]]],
    rates: Sequence[float | None],
    test: str | None,
    uses: Sequence[Use],
) -> tuple[RecordGuess, ...]:
    """Return the records of all files, each with its use.

    Args:
        surveys: The files.
        parts: Rows of the records of each file.
        rates: Rate of each file [Hz], where it is to be written.
        test: What the user said of test records, or None.
        uses: What each file is for but for tests; what is identified is not cut.

    Raises:
        InputError: `test` names no file.
    """
    found = []
    names = _names(surveys)
    for survey, rows, rate_hz, name, use in zip(surveys, parts, rates, names, uses, strict=True):
        for one in rows:
            whole = one == (0, survey.rows)
            found.append(RecordGuess(file=survey.path, group=survey.group, title=_title(survey), use=use.use,
                                     why=use.why, rows=None if whole else one, name=name, rate_hz=rate_hz))  # fmt: skip
    _check_test(found, test)
    if test == NO_TEST:
        return tuple(found)
    if len(found) == 1 and found[0].use != "identify":
        return _cut_in_two(found[0], surveys[0].rows)
    return _choose_tests(found, test)


def _names(surveys: Sequence[Survey]) -> list[str | None]:
    """Return names where two files have one stem, else None; groups of one file get theirs when they are read."""
    paths = list(dict.fromkeys(survey.path for survey in surveys))
    stems = {path: path.name.partition(".")[0] for path in paths}
    twice = {path for path, stem in stems.items() if list(stems.values()).count(stem) > 1}
    return [
        None if one.path not in twice
        else "-".join([one.path.parent.name, stems[one.path], *re.findall(r"\w+", one.group or "")])
        for one in surveys
    ]  # fmt: skip


def _title(survey: Survey) -> str:
    """Return the single texts of a group, such as the comment of a measurement; "" of a whole file."""
    if survey.group is None:
        return ""
    texts = [
        str(one.raw[0]).strip()
        for one in survey.columns.values()
        if one.raw is not None and one.rows == 1 and one.raw.dtype.kind in "OU"
    ]
    return ", ".join(text for text in texts if text)[:LONGEST_TITLE]


def _cut_in_two(record: RecordGuess, rows: int) -> tuple[RecordGuess, ...]:
    """Cut one record: the last third is the test, which begins where the record does, unscored until then.

    What counts from a record's start, a drift or a memory, is the same in both parts so.
    """
    first, end = record.rows or (0, rows)
    if end - first < FEWEST_ROWS:
        return (record,)
    cut = end - int(TEST_SHARE * (end - first))
    fit = replace(record, rows=(first, cut), why="the first two thirds")
    why = f"the last third; the {cut - first} rows before it, which the fit has, only lead there from the same start"
    return fit, replace(record, rows=(first, end), ignore_first=cut - first, use="test", why=why)


def called(record: RecordGuess | Survey) -> str:
    """Return how a record is called: its group with its title, else its file."""
    path, title = (record.path, _title(record)) if isinstance(record, Survey) else (record.file, record.title)
    return path.stem if record.group is None else f"{record.group} {title}"


def _check_test(records: Sequence[RecordGuess], test: str | None) -> None:
    """Raise InputError where the test record that the user names is none of the files or groups."""
    names = [(one.file.name, one.group) for one in records]
    if test in (None, LAST_THIRD, NO_TEST) or any(test in one for one in names):
        return
    known = [*(group or file for file, group in names), LAST_THIRD, NO_TEST]
    what = "group or data file" if any(group for _, group in names) else "data file"
    raise InputError(f"--test {test}: no such {what}{nearest(str(test), known)}")


def _choose_tests(records: Sequence[RecordGuess], test: str | None) -> tuple[RecordGuess, ...]:
    names = [(one.file.name, one.group) for one in records]
    usable = [k for k, one in enumerate(records) if one.use != "identify"]
    named = [k for k in usable if says_test(called(records[k]))]
    if test is not None and test != LAST_THIRD:
        chosen, why = [k for k, one in enumerate(names) if test in one], "you said so"
    elif named and len(named) < len(records):
        chosen, why = named, BY_NAME
    elif len(usable) < 2:
        chosen, why = [], ""
    else:
        chosen = usable[2::3] if len(usable) > 2 else usable[-1:]
        why = "every third record" if len(chosen) > 1 else "one record that no fit uses"
    return tuple(replace(one, use="test", why=why) if k in chosen else one for k, one in enumerate(records))
