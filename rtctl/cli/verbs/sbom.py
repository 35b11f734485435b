"""What the program consists of here: packages, versions and licences, also as a bill of materials in CycloneDX JSON."""

from __future__ import annotations

import argparse
from pathlib import Path

COMMAND = "sbom"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl sbom`."""
    parser.add_argument(
        "--out", type=Path, metavar="FILE.json", help="write the bill of materials (CycloneDX 1.5)"
    )


def run(args: argparse.Namespace) -> int:
    """Print a table, or the bill as JSON. Returns 0."""
    from rtctl.api.materials import list_materials
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.tables import print_table

    if args.out is not None:
        output_file(args.out, "a bill of materials", COMMAND)
    listed = list_materials()
    if args.out is not None:
        listed.save(args.out)
    found = listed.packages
    if args.json:
        print_json(listed.to_dict())
    elif not args.quiet:
        rows = [
            [one.name, one.version, one.licence or "not stated", "" if one.needed else "extra"]
            for one in found
        ]
        print_table("packages", ["name", "version", "licence", ""], rows)
        silent = sum(not one.licence for one in found)
        print(
            f"{len(found)} packages, {silent} whose metadata state no licence; beside them a copy of uPlot (MIT)"
        )
    return 0
