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
    parser.add_argument(
        "--export", type=Path, metavar="DIR",
        help="folder of `rtctl export c`: compute the run with it, on this computer and on emulated processors whose "
        "tools are there, and compare the bits",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: the same to the bit; 1: it differs."""
    if args.export is not None:
        return _run_export(args)
    from rtctl.api.runs.recordings import replay
    from rtctl.cli.options import output_file, output_folder, print_json
    from rtctl.cli.printing.runs import print_replay

    folder = None if args.out is None else output_folder(args.out)
    if folder is not None:
        output_file(folder / "replayed.parquet", "a recording", "replay")
    replayed = replay(args.run)
    if folder is not None:
        replayed.save(folder)
    if args.json:
        print_json(replayed.to_dict())
    elif not args.quiet:
        print_replay(replayed)
    return 0 if replayed.same else 1


def _run_export(args: argparse.Namespace) -> int:
    """Compare what an exported loop computes of the run."""
    from rtctl.api.exporting.c import replay_export
    from rtctl.cli.options import print_json
    from rtctl.cli.printing.runs import print_proof

    proof = replay_export(args.run, args.export)
    if args.json:
        print_json(proof.to_dict())
    elif not args.quiet:
        print_proof(proof)
    return 0 if proof.same else 1
