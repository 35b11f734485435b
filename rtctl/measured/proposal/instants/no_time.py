"""Why a column that is called as a time is, or that holds dates, does not tell the instants of the samples."""

from __future__ import annotations

import numpy as np

from rtctl.measured.columns.time_column import UnclearInstantError
from rtctl.measured.proposal.instants.column_time import read_time
from rtctl.measured.proposal.naming.column_names import WEAK
from rtctl.measured.proposal.naming.column_units import quantity_of, read_column
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.readers.whole_file.split_instants import JOINT

_HOUR_S, _SAME = 3600.0, 0.05
"""What clocks go back by where daylight-saving time ends, and its relative rounding by the step of the rows."""


def describe_no_times(survey: Survey) -> str:
    """Return why the columns of a file that may be the time are none, with what to do; "": it has no such column."""
    found = {
        one.name: text
        for one in survey.columns.values()
        if (one.rows == survey.rows or one.raw is None) and (text := _why_not(one))
    }
    parts = {
        part for name in found if JOINT in name for part in name.split(JOINT)
    }  # told with the whole instant
    return "; ".join(text for name, text in found.items() if name not in parts)


def _why_not(column: Column) -> str:
    reading = read_column(column)
    is_called = reading.votes.get("time", 0.0) >= WEAK or quantity_of(reading.unit.text or "m") == "time"
    if column.values is not None:
        if not is_called:
            return ""
        if not np.isfinite(column.values).all():
            row, count = int(np.argmin(np.isfinite(column.values))), int(np.sum(~np.isfinite(column.values)))
            if count > 1:
                return (
                    f'the time column "{column.name}" has no number in {count} rows, first row {row} (counted from 0): '
                    "write the times there, or remove these rows, whose gap in time then divides the record"
                )
            return (
                f'the time column "{column.name}" has no number in row {row} (counted from 0): write the time there, '
                "or remove the row"
            )
        unit = f" {reading.unit.text}" if reading.unit.text else ""
        return _back(column.name, np.asarray(column.values), unit)
    if column.raw is None:
        unclear = column.refusal.startswith("is not clear")
        return f'the time column "{column.name}" {column.refusal}' if is_called and unclear else ""
    try:
        stamps = read_time(column, None)
    except UnclearInstantError as error:
        return f"the time {error}" if is_called else ""
    except ValueError:
        return _words_in(column) if is_called else ""
    return _back(column.name, np.asarray(stamps.time_s), " s", is_clock=True)


def _words_in(column: Column) -> str:
    what, _, _ = column.refusal.rpartition("; ")
    return (
        f'the time column "{column.name}" {what or column.refusal}: correct these cells; a row whose time is not known '
        "must be removed"
    )


def _back(name: str, times: np.ndarray, unit: str, *, is_clock: bool = False) -> str:
    """Return where times go back, or stay, and by how much; "": they do not."""
    steps = np.diff(times)
    if np.all(steps > 0.0) or not np.any(steps):  # constant: an exposure time
        return ""
    row = int(np.argmin(steps > 0.0))
    if steps[row] == 0.0:
        return (
            f'the time column "{name}" stays the same after row {row} (counted from 0): write it with more digits, '
            "or remove rows that are there twice"
        )
    usual = float(np.median(steps))
    lost = usual - float(steps[row])
    told = f'the time column "{name}" goes back by {-steps[row]:.6g}{unit} after row {row} (counted from 0)'
    if is_clock and abs(lost - _HOUR_S) <= _SAME * _HOUR_S:
        return (
            f"{told}, as clocks do by 3600 s where daylight-saving time ends, and times that are written without "
            "their hours: write the times in UTC or in seconds; if the rows follow each other evenly, say "
            "--sample-rate HZ"
        )
    return (
        f"{told}, so its rows are out of order or of several records: divide the file there, or put the rows in order; "
        "if the rows follow each other evenly, say --sample-rate HZ --time -"
    )
