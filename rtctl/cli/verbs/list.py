"""Scenarios, plants, drivers, estimators, controllers and mechanisms that there are, those of your own marked."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtctl.registry import Entry

SORTS = ("scenarios", "plants", "drivers", "estimators", "controllers", "mechanisms")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl list`."""
    parser.add_argument("sort", nargs="?", metavar="SORT", help=f"only one of {', '.join(SORTS)}")


def run(args: argparse.Namespace) -> int:
    """Print the list, or one JSON object with a list for each sort. Raises InputError for an unknown sort."""
    from rtctl.border.errors import InputError, nearest

    if args.sort is not None and args.sort not in SORTS:
        raise InputError(f'there is no list of "{args.sort}"{nearest(args.sort, SORTS)}')
    found = {sort: _rows(sort) for sort in SORTS if args.sort in (None, sort)}
    if args.json:
        print(json.dumps(found, indent=2, ensure_ascii=False))
    elif not args.quiet:
        _print(found)
    return 0


def _rows(sort: str) -> list[dict[str, Any]]:
    """Return a row a part: name, what it is, kinds of plant, origin ("rtctl", or where the user's comes from)."""
    from rtctl.registry import entries, mechanisms_of, plant_kinds
    from rtctl.scenario.bundled import bundled_titles

    if sort == "scenarios":
        return [_row(name, title) for name, title in bundled_titles().items()]
    if sort == "mechanisms":
        own = {entry.name: entry for entry in entries("mechanism")}
        with_some = [name for name, kind in plant_kinds().items() if kind.model and kind.model.mechanisms]
        return [
            _row(identity, mechanism.statement, (kind,), own[identity].origin if identity in own else "rtctl")
            for kind in with_some
            for identity, mechanism in mechanisms_of(kind).items()
        ]
    parts: dict[str, tuple[Entry, ...]] = {
        "plants": entries("plant"), "drivers": entries("driver"), "estimators": entries("estimator"),
        "controllers": entries("controller"),
    }  # fmt: skip
    return [_row(entry.name, entry.summary, entry.plants, entry.origin) for entry in parts[sort]]


def _row(name: str, summary: str, plants: tuple[str, ...] = (), origin: str = "rtctl") -> dict[str, Any]:
    return {
        "name": name,
        "summary": summary,
        "plants": list(plants),
        "origin": origin,
        "own": origin != "rtctl",
    }


def _print(found: dict[str, list[dict[str, Any]]]) -> None:
    from rtctl.output.progress import print_table

    for sort, rows in found.items():
        lines = [
            [
                row["name"],
                row["summary"],
                ", ".join(row["plants"]) or "–",
                row["origin"] if row["own"] else "",
            ]
            for row in rows
        ]
        print_table(sort, ["name", "", "for", "your own, from"], lines)
