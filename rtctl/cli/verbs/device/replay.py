"""Run a recorded measurement through estimator, controller and limits again and compare to the bit."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl replay`."""
    parser.add_argument("run", type=Path, help="folder of an rtctl run, or of one that was killed")
    parser.add_argument(
        "--out", type=Path, help="folder for replayed.parquet: what was computed anew, a row a sample"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: the same to the bit; 1: it differs."""
    from rtctl.api.recordings import replay
    from rtctl.cli.options import output_folder, print_json
    from rtctl.cli.printing.runs import print_replay

    folder = None if args.out is None else output_folder(args.out)
    replayed = replay(args.run)
    if folder is not None:
        replayed.save(folder)
    if args.json:
        print_json(replayed.to_dict())
    elif not args.quiet:
        print_replay(replayed)
    return 0 if replayed.same else 1
