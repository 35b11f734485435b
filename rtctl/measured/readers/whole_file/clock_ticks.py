"""Timestamps that count the ticks of a clock whose rate stands elsewhere in the file: `clockbase` of lock-ins."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from rtctl.measured.readers.stated.attributes import numbers_of
from rtctl.measured.readers.stated.beside import MOST_NUMBERS
from rtctl.measured.readers.table import Header, Table, length

_RATE, _PERIOD = "clockbase", "timebase"
"""Keys of the ticks per second, and of the seconds per tick (Zurich Instruments)."""
_STAMP = re.compile(r"(?:time_?stamp|tick)s?", re.IGNORECASE)


def with_clock(table: Table) -> Table:
    """Return the table with the rate of the clock as the unit of the timestamps that count its ticks."""
    rates = _rates(table)
    if len(rates) != 1:
        return table
    unit = f"{rates.pop():.12g} Hz"
    headers = {
        name: header._replace(unit=unit) if _counts_ticks(table, name, header) else header
        for name, header in table.columns.items()
    }
    return replace(table, columns=headers)


def _rates(table: Table) -> set[float]:
    """Return the rates of clocks [Hz] that the groups of a file state."""
    found = set[float]()
    for level in table.beside.values():
        for key, value in level.items():
            try:
                numbers = numbers_of(value) if key.lower() in (_RATE, _PERIOD) else np.empty(0)
            except (ValueError, TypeError):
                continue
            if len(numbers) == 1 and 0.0 < numbers[0] < np.inf:
                rate = numbers[0] if key.lower() == _RATE else 1.0 / numbers[0]
                found.add(float(f"{rate:.12g}"))
    return found


def _counts_ticks(table: Table, name: str, header: Header) -> bool:
    """Return whether a column is called a timestamp, without a unit, and holds whole numbers."""
    place = table.place(name)
    own = place.within(place.groups[-1]) if place.groups else name
    if (
        header.refusal
        or header.unit
        or not _STAMP.fullmatch(own)
        or max(header.shape, default=0) <= MOST_NUMBERS
    ):
        return False
    try:
        values = table.load(name, 0, length(header.shape))
    except ValueError:
        return False
    return values.dtype.kind in "iu" or (
        values.dtype.kind == "f" and bool(np.all(values == np.round(values)))
    )
