"""What there is to choose from: scenarios, plants, drivers, estimators, controllers, mechanisms."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from rtctl.border.errors import InputError, nearest
from rtctl.output.notebook import html_table
from rtctl.registry import entries, mechanisms_of, plant_kinds
from rtctl.registry.parts import OURS, Part

SORTS: dict[str, Part] = {
    "plants": "plant", "drivers": "driver", "estimators": "estimator", "controllers": "controller",
}  # fmt: skip
"""Sorts of part whose entries in the registry say all."""
ALL_SORTS = ("scenarios", *SORTS, "mechanisms")


@dataclass(frozen=True, slots=True, kw_only=True)
class PartInfo:
    """A scenario, plant, driver, estimator, controller or mechanism that files can name."""

    name: str
    summary: str
    plants: tuple[str, ...]
    """Kinds of plant that it is for; empty: all."""
    origin: str
    """"rtctl", or the file, module or distribution of a part of your own."""

    @property
    def is_own(self) -> bool:
        """Whether the part is the user's."""
        return self.origin != OURS

    def to_dict(self) -> dict[str, Any]:
        """Return the record as `rtctl list --json` prints it."""
        return {**asdict(self), "plants": list(self.plants), "own": self.is_own}


class PartList(dict[str, tuple[PartInfo, ...]]):
    """Parts by sort; a notebook shows them as tables."""

    def _repr_html_(self) -> str:
        return "".join(
            "<details open><summary>"
            f"{len(parts)} {sort}</summary>{html_table('', HEADERS, rows(parts), most_rows=len(parts))}</details>"
            for sort, parts in self.items()
        )


HEADERS = ("name", "what it is", "for", "your own, from")


def rows(parts: Iterable[PartInfo]) -> list[list[str]]:
    """Return a row of texts for each part, in the order of `HEADERS`."""
    return [
        [part.name, part.summary, ", ".join(part.plants) or "–", part.origin if part.is_own else ""]
        for part in parts
    ]


def list_parts(sort: str | None = None) -> PartList:
    """List what scenarios, model files and calls can name, your own parts included.

    Args:
        sort: "scenarios", "plants", "drivers", "estimators", "controllers" or "mechanisms"; None: all.

    Returns:
        The parts by sort, those of the program first.

    Raises:
        InputError: There is no such sort, or a part of your own does not import.
    """
    if sort is not None and sort not in ALL_SORTS:
        raise InputError(f'there is no list of "{sort}"{nearest(sort, ALL_SORTS)}')
    return PartList({one: tuple(_parts(one)) for one in ALL_SORTS if sort in (None, one)})


def _parts(sort: str) -> Iterable[PartInfo]:
    from rtctl.scenario.bundled import bundled_titles

    if sort == "scenarios":
        return [
            PartInfo(name=n, summary=title, plants=(), origin=OURS) for n, title in bundled_titles().items()
        ]
    if sort == "mechanisms":
        own = {entry.name: entry.origin for entry in entries("mechanism")}
        with_some = [name for name, kind in plant_kinds().items() if kind.model and kind.model.mechanisms]
        return [
            PartInfo(name=id_, summary=one.statement, plants=(kind,), origin=own.get(id_, OURS))
            for kind in with_some
            for id_, one in mechanisms_of(kind).items()
        ]
    return [
        PartInfo(name=entry.name, summary=entry.summary, plants=entry.plants, origin=entry.origin)
        for entry in entries(SORTS[sort])
    ]
