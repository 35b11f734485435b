"""Scenarios, plants, drivers, estimators, controllers and mechanisms that there are, those of your own marked."""

from __future__ import annotations

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl list`."""
    parser.add_argument("sort", nargs="?", metavar="SORT", help="only one of them, such as drivers")


def run(args: argparse.Namespace) -> int:
    """Print the list, or one JSON object with a list for each sort. Raises InputError for an unknown sort."""
    from rtctl.api.parts import HEADERS, list_parts, rows
    from rtctl.cli.options import print_json
    from rtctl.output.tables import print_table

    found = list_parts(args.sort)
    if args.json:
        print_json({sort: [part.to_dict() for part in parts] for sort, parts in found.items()})
    elif not args.quiet:
        for sort, parts in found.items():
            print_table(sort, HEADERS, rows(parts))
    return 0
