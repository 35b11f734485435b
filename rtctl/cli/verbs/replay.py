"""Run a recorded measurement through estimator, controller and limits again and compare to the bit."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl replay`."""
    parser.add_argument("run", type=Path, help="folder of an rtctl run, or of one that was killed")
    parser.add_argument(
        "--out", type=Path, help="folder for replayed.parquet: what was computed anew, a row a sample"
    )


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 0: the same to the bit; 1: it differs."""
    from rtctl.cli.options import output_folder
    from rtctl.recording import write_parquet
    from rtctl.session.replay import read_run, replay, summary_of

    folder = None if args.out is None else output_folder(args.out)
    recorded = read_run(args.run)
    found, columns = replay(recorded)
    if folder is not None:
        table = {"index": recorded.signals["index"], **columns}
        write_parquet(
            folder / "replayed.parquet", table, {}, {"program": "rtctl", "replay_of": str(args.run)}
        )
    if args.json:
        print(json.dumps(summary_of(found, args.run), indent=2))
    elif not args.quiet and found.first is None:
        print(
            f"{found.rows} samples replayed: estimates, terms and commands are the recorded ones, to the bit"
        )
    elif not args.quiet and found.first is not None:
        first = found.first
        print(
            f"{found.rows} samples replayed; they differ first at sample {first.index}: {first.column} was "
            f"{first.recorded!r}, is {first.replayed!r}"
        )
        for name, rows in found.differing.items():
            print(f"  {name}: {rows} samples differ")
    return 0 if found.first is None else 1
