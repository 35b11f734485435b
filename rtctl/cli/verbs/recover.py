"""Make Parquet files and a summary of what a run had recorded when it was killed."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl recover`."""
    parser.add_argument("run", type=Path, help="folder of the run that was killed")


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from rtctl.session.recovery import recover

    summary = recover(args.run)
    steps = summary["timing"]["steps"]
    if args.json:
        print(json.dumps(summary, indent=2))
    elif not args.quiet:
        seconds = steps * summary["timing"]["period_s"]
        print(f"{steps} samples ({seconds:.4g} s) recovered; results in {args.run}")
    return 0
