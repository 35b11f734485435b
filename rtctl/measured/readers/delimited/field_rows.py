"""Text files that hold each signal as a row behind its name, as LabOne exports them: refused, with what to do."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.measured.readers.delimited.names import SEPARATORS, cells_of

_HEAD = ["chunk", "timestamp", "size", "fieldname"]


def check_no_field_rows(lines: Sequence[str]) -> None:
    """Raise ValueError where the first of the opening lines is the head of such a file."""
    first = lines[0] if lines else ""
    for separator in SEPARATORS:
        if [cell.lower() for cell in cells_of(first, separator)[: len(_HEAD)]] == _HEAD:
            raise ValueError(
                'holds a row for each field ("chunk", "timestamp", "size", "fieldname", then the numbers), as LabOne '
                "of Zurich Instruments exports it, and columns are needed: export it again as MATLAB or HDF5, or write "
                "the fields of each chunk as columns of a file of its own"
            )
