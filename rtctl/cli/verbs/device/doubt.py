"""Whether the device of a run still is its model, and what changed if not; also of a run under way."""

from __future__ import annotations

import argparse
from pathlib import Path

NICENESS = 5
"""The watch gives way to the loop where they share a processor."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl doubt`."""
    parser.add_argument("run", type=Path, help="folder of an rtctl run, or of one that was killed")
    parser.add_argument("--live", action="store_true", help="follow a run under way until it ends")
    parser.add_argument(
        "--policy", choices=["warn", "derate", "stop", "retune"], default="warn",
        help="what to do about a change in a run under way: say so, halve the gains, end at the safe levels, let a "
        "model with the cause take over on trial",
    )  # fmt: skip
    parser.add_argument(
        "--without-reference", action="store_true", help="use commands and readings alone, as the loop does"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.json", help="result (default: doubt.json in the folder)"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: no change was seen; 1: something was found; 2: the run is too short to know."""
    import os

    from rtctl.api.runs.doubting import doubt
    from rtctl.cli.options import print_json
    from rtctl.cli.printing.doubt import finding_line, summary_lines

    if args.live:
        os.nice(NICENESS)
    shown = not (args.json or args.quiet)
    summary = doubt(
        args.run,
        live=args.live,
        policy=args.policy,
        reference=not args.without_reference,
        out=args.out,
        say=lambda finding, done: print(finding_line(finding, done), flush=True) if shown else None,
    )
    if args.json:
        print_json(summary, "doubt")
    elif shown:
        print("\n".join(summary_lines(summary)))
    if any(one["kind"] != "learned" for one in summary["findings"]):
        return 1
    return 0 if summary["windows_compared"] else 2
