"""Parts of a study: steps that each yield a section; sections of figures beside the paper's, tables, pictures.

A section is plain data (numbers, text, names of PNG files), so that a finished step is kept as JSON and not run again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One figure of the paper beside ours; None where one of them has none, and `note` says why."""

    quantity: str
    unit: str
    """Unit as it is written: "um", "%"; "" without a unit."""
    paper: float | None
    ours: float | None
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """Ours over the paper's."""
        if self.paper is None or self.ours is None or self.paper == 0.0:
            return None
        ratio = self.ours / self.paper
        return ratio if math.isfinite(ratio) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A table of figures, the paper's beside ours."""

    title: str
    rows: tuple[Row, ...]
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Any other table; cells are text. Columns in `numbers` are aligned right."""

    title: str
    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text: str = ""
    numbers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.headers):
                raise ValueError(
                    f'table "{self.title}": {len(self.headers)} headers, but a row of {len(row)} cells'
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """An image that the step has drawn into `Run.pictures`."""

    file: str
    """Its name in that folder, such as "fig06-frequency.png"."""
    caption: str
    alt: str


Part = Comparison | Table | Picture
KINDS: dict[str, type[Comparison] | type[Table] | type[Picture]] = {
    "comparison": Comparison,
    "table": Table,
    "picture": Picture,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Result of one step. `text`: method and conclusions, paragraphs separated by an empty line."""

    title: str
    text: str
    parts: tuple[Part, ...] = field(default=())


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Inputs of a step."""

    out: Path
    """Folder for its own files."""
    pictures: Path
    """Folder of the report's pictures."""
    short: bool
    """Whether fewer seeds and shorter records are used, for tests."""


@dataclass(frozen=True, slots=True)
class Step:
    """Computation of one section; `name` is its file's, in the order of the report."""

    name: str
    compute: Callable[[Run], Section]


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A paper's study."""

    name: str
    """Name in `rtctl reproduce NAME`."""
    title: str
    paper: str
    """The reference."""
    lead: str
    """Introduction of the report: what the study is and on which plants it runs."""
    steps: tuple[Step, ...]
    faults: tuple[str, ...] = ()
    """Errors of the paper as printed, one sentence each."""


def as_json(section: Section) -> dict[str, Any]:
    """Return plain data of a section."""
    names = {kind: name for name, kind in KINDS.items()}
    parts = []
    for part in section.parts:
        content = {key: getattr(part, key) for key in part.__slots__}
        if isinstance(part, Comparison):
            content["rows"] = [
                {
                    "quantity": r.quantity,
                    "unit": r.unit,
                    "paper": r.paper,
                    "ours": r.ours,
                    "ratio": r.ratio,
                    "note": r.note,
                }
                for r in part.rows
            ]
        parts.append({"kind": names[type(part)], **content})
    return {"title": section.title, "text": section.text, "parts": parts}


def from_json(content: dict[str, Any]) -> Section:
    """Return the section that `as_json` wrote."""
    return Section(
        title=content["title"], text=content["text"], parts=tuple(_part(part) for part in content["parts"])
    )


def _part(content: dict[str, Any]) -> Part:
    if content["kind"] == "comparison":
        rows = tuple(Row(**{key: row[key] for key in Row.__slots__}) for row in content["rows"])
        return Comparison(title=content["title"], rows=rows, text=content["text"])
    if content["kind"] == "table":
        return Table(
            title=content["title"],
            headers=tuple(content["headers"]),
            rows=tuple(tuple(row) for row in content["rows"]),
            text=content["text"],
            numbers=tuple(content["numbers"]),
        )
    return Picture(file=content["file"], caption=content["caption"], alt=content["alt"])
