"""A recorded run as a file for other programs: mcap, for PlotJuggler, Foxglove and Lichtblick."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl export`."""
    parser.add_argument("format", choices=("mcap",), help="mcap: rows, times, changes and events of a run")
    parser.add_argument(
        "source", metavar="RUN", type=Path, help="folder of a run (its --out), under way, ended or killed"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="such as run.mcap")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.recordings import export_mcap
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.progress import say

    rows = export_mcap(args.source, output_file(args.out, "an MCAP file"))
    if args.json:
        print_json({"file": str(args.out), "rows": rows})
    else:
        say(f"{args.out}: {rows} rows", quiet=args.quiet)
    return 0
