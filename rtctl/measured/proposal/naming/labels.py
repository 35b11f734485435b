"""What a column in a group is called: its own name, and the group's only where its own says nothing.

In a group `shaker run` of `force` and `acc` these names tell; in groups `force` and `acc` of one `data` each,
the groups do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rtctl.measured.proposal.naming.column_names import read_name
from rtctl.measured.proposal.naming.column_units import MOTIONS, quantity_of, read_column
from rtctl.measured.proposal.survey import Column


def with_labels(columns: Mapping[str, Column]) -> dict[str, Column]:
    """Return the columns of a file, each with the words that tell what it is."""
    own = {name: replace(one, label=_own_name(one)) for name, one in columns.items()}
    silent = [one for one in own.values() if _says_nothing(one)]
    return own | {one.name: replace(one, label=_with_group(one, silent)) for one in silent}


def _own_name(column: Column) -> str:
    """Return a column's name within its group; the whole one where a slash stands before a unit: `Kraft/N`."""
    if not column.place.groups:
        return column.name
    whole = read_name(column.place.path)
    if whole.habit == "after a slash" and whole.votes:
        return column.place.path
    return column.place.within(column.place.groups[-1])


def _says_nothing(column: Column) -> bool:
    unit = read_column(column).unit.text
    return not read_name(column.label).votes and (not unit or quantity_of(unit) not in MOTIONS)


def _with_group(column: Column, silent: list[Column]) -> str:
    """Return a name behind that of the innermost group that has no other column without a telling name."""
    for group in reversed(column.place.groups):
        if sum(group in other.place.groups for other in silent) == 1 and read_name(group).votes:
            return f"{group} {column.label}"
    return column.label
