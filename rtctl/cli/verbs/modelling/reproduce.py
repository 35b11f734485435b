"""A paper's study on our plants, its figures beside ours: DIR/report.html, DIR/report.md, DIR/results.json."""

from __future__ import annotations

import argparse
from pathlib import Path

from rtctl.api.campaigns import STUDIES


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl reproduce`."""
    parser.add_argument("study", choices=STUDIES, help="which published study")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the report; a stopped study goes on there"
    )
    parser.add_argument(
        "--short", action="store_true", help="fewer seeds and shorter records: a look in seconds"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.campaigns import reproduce_study
    from rtctl.cli.options import is_quiet, output_folder, print_json

    folder = output_folder(args.out)
    results = reproduce_study(args.study, folder, short=args.short, progress=not is_quiet(args))
    if args.json:
        print_json(results)
    elif not args.quiet:
        print(f"report in {folder / 'report.html'}")
    return 0
