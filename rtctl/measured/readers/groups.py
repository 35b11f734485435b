"""Groups of columns within a file: a struct of MATLAB, a group of HDF5 or TDMS, a channel group of MDF.

Within a group a column has the rest of its path as its name: `F_nN` in `rec(2)` is `rec(2).F_nN`. What stands above a
group belongs to all groups below, so a column that the group lacks is sought there: a time axis that all runs share.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rtctl.border.errors import nearest


class Place(NamedTuple):
    """Place of a column in its file."""

    path: str
    """Path from the top: `run_001/force`, `rec(2).F_nN`."""
    groups: tuple[str, ...] = ()
    """Paths of the groups around it, the outermost first; (): it is at the top."""

    def within(self, group: str) -> str:
        """Return its name as seen from a group around it ("": from the top)."""
        return self.path[len(group) + 1 :] if group else self.path

    def serves(self, home: tuple[str, ...]) -> bool:
        """Return whether it belongs to all of a group, given with those around it: it is in it, or above it."""
        return home[: len(self.groups)] == self.groups


TOP = Place("")
"""Place of a column of which no group is known."""


def place_of(path: str, separator: str) -> Place:
    """Return the place of a column whose path joins groups and name by a separator."""
    parts = path.split(separator)
    return Place(path, tuple(separator.join(parts[:k]) for k in range(1, len(parts))))


def names_within(places: Mapping[str, Place], group: str) -> dict[str, str]:
    """Return the columns that a group sees, by their names within it.

    Args:
        places: Place of each column of the file.
        group: Path of the group.

    Raises:
        ValueError: The file has no groups, or none of that path.
    """
    known = {one for place in places.values() for one in place.groups}
    if not known:
        raise ValueError(f'group = "{group}": the file has no groups of columns; remove group')
    if group not in known:
        raise ValueError(f'no group "{group}" in the file{nearest(group, known)}')
    around = next(place.groups for place in places.values() if group in place.groups)
    found: dict[str, str] = {}
    for above in ("", *around[: around.index(group)]):
        found |= {
            place.within(above): name
            for name, place in places.items()
            if (place.groups or ("",))[-1] == above
        }
    return found | {place.within(group): name for name, place in places.items() if group in place.groups}


def missing_name(places: Iterable[Place], group: str, name: str) -> str:
    """Return the path that a column would have in a group that lacks it, for the message about it."""
    inside = next((one.path for one in places if group in one.groups), f"{group}/")
    return f"{group}{inside[len(group)]}{name}"
