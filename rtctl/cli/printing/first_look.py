"""A first look at data as a person reads it in a terminal: signals, records, what to look at."""

from __future__ import annotations

from collections.abc import Collection

from rtctl.api.first_look.initiation import Initiation
from rtctl.api.first_look.preview import Preview
from rtctl.measured.summary import RECORD_HEADERS, SIGNAL_HEADERS, record_rows, signal_rows
from rtctl.output.tables import print_table

MOST_ROWS = 40
"""Records that are printed."""


def print_initiation(found: Initiation) -> None:
    """Print what was read, what was guessed and is not sure, and what was written."""
    print_preview(found.summary, told=found.unsure)
    for text in found.unsure:
        print(f"look at: {text}")
    for column, why in found.proposal.unused.items():
        print(f'not used: column "{column}" ({why})')
    picture = "" if found.picture is None else f" and {found.picture}"
    print(f"wrote {found.path}{picture}")


def print_preview(shown: Preview, told: Collection[str] = ()) -> None:
    """Print the tables of signals and records, and the remarks but those that are `told` below."""
    summary = shown.summary
    print_table(f"{summary.name}: signals", SIGNAL_HEADERS, signal_rows(summary))
    rows = record_rows(summary)
    print_table(f"{summary.name}: records", RECORD_HEADERS, rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        print(f"{len(rows) - MOST_ROWS} more records")
    for note in summary.notes:
        if note not in told:
            print(f"note: {note}")
