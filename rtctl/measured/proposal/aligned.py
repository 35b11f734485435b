"""The columns of a record as they will be read: from the first instant that all have, each as long as the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rtctl.measured.columns.alignment import leading_rows
from rtctl.measured.proposal.instants.told_rate import told_rate_hz
from rtctl.measured.proposal.proposal import TimeGuess
from rtctl.measured.proposal.survey import OTHER_RATES, Column, Survey


def aligned(survey: Survey, signals: Sequence[str], time: TimeGuess) -> Survey:
    """Return a survey whose rows are those of the record: of its signals, its time and its single values.

    Args:
        survey: A file, or a group of it.
        signals: Columns of the signals.
        time: What tells the instants; columns beside a time column are not aligned.

    Raises:
        ValueError: The columns differ in length, or begin a part of a sample period after each other.
    """
    names = [*signals, *(name for name in survey.columns if name == time.column)]
    used = {name: survey.columns[name] for name in names if survey.columns[name].raw is not None}
    leads = _leads(survey, used, time)
    if not any(leads.values()):
        _check_lengths(used)
    left = min((max(one.rows - leads[name], 0) for name, one in used.items()), default=survey.rows)
    if left == survey.rows and not any(leads.values()):
        return survey
    single = {name: one for name, one in survey.columns.items() if one.rows == 1}
    return replace(
        survey, columns=single | {name: _cut(one, leads[name], left) for name, one in used.items()}
    )


def _leads(survey: Survey, used: Mapping[str, Column], time: TimeGuess) -> dict[str, int]:
    """Return the rows of each column before the instant from which it is read."""
    stated_s = next((one.period_s for one in used.values() if one.period_s), None)
    rate_hz = time.rate_hz or time.stated_hz or told_rate_hz(survey)
    period_s = 1.0 / rate_hz if rate_hz else stated_s
    if time.column is not None or period_s is None:
        return dict.fromkeys(used, 0)
    return leading_rows(used, period_s)


def _check_lengths(used: Mapping[str, Column]) -> None:
    """Raise ValueError where columns differ in length, with what to do."""
    if len({one.rows for one in used.values()}) < 2:
        return
    counts = ", ".join(f'"{name}" has {one.rows or "no"} rows' for name, one in used.items())
    is_short = any(one.rows < 2 for one in used.values())
    remedy = "; export what is so short again, or name other columns" if is_short else OTHER_RATES
    raise ValueError(f"the columns of a record differ in length: {counts}{remedy}")


def _cut(column: Column, first: int, rows: int) -> Column:
    """Return a column from row `first` on, `rows` of them."""
    raw, values = column.raw, column.values
    part = slice(first, first + rows)
    return replace(
        column, raw=None if raw is None else raw[part], values=None if values is None else values[part]
    )
