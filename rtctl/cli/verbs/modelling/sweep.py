"""Many simulations from one file: a model over a grid or a design, on all cores or a cluster, with one result."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl sweep`."""
    parser.add_argument("campaign", help="campaign file, or the name of a bundled one")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the results; an interrupted one goes on"
    )
    parser.add_argument(
        "--scheduler", metavar="tcp://HOST:PORT", help="a Dask cluster instead of this machine"
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes on this machine (default: its cores)"
    )
    parser.add_argument("--no-plot", action="store_true", help="draw no picture")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.campaigns import sweep
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.sweep import print_sweep

    folder = output_folder(args.out)
    summary = sweep(
        args.campaign, folder, workers=args.workers, scheduler=args.scheduler, plot=not args.no_plot,
        progress=not is_quiet(args),
    )  # fmt: skip
    if args.json:
        print_json(summary, "sweep")
    elif not args.quiet:
        print_sweep(summary, folder)
    return 0
