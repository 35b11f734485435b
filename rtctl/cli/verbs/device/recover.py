"""Make Parquet files and a summary of what a run had recorded when it was killed."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl recover`."""
    parser.add_argument("run", type=Path, help="folder of the run that was killed")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.runs.recordings import recover
    from rtctl.cli.options import print_json

    summary = recover(args.run)
    steps = summary["timing"]["steps"]
    if args.json:
        print_json(summary)
    elif not args.quiet:
        seconds = steps * summary["timing"]["period_s"]
        print(f"{steps} samples ({seconds:.4g} s) recovered; results in {args.run}")
    return 0
