"""Change the set-point or a gain of a run that is under way; recorded with its sample among the run's events."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl set`."""
    parser.add_argument("run", type=Path, help="folder into which the run records (its --out)")
    parser.add_argument(
        "change",
        metavar="NAME=VALUE",
        help='setpoint="30 um" (in the unit of the scenario\'s output if none is given), setpoint=plan, '
        "controller.kp=0.02, controller.ki=8",
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: the run has taken it and applies it at its next step."""
    from rtctl.api.recordings import change
    from rtctl.cli.options import print_json
    from rtctl.output.progress import say

    asked, _, written = args.change.partition("=")
    name, value = change(args.run, asked, written)
    if args.json:
        print_json({"name": name, "value": value})
    else:
        say(f"{args.change}: applied at the next step, see {args.run / 'events.jsonl'}", quiet=args.quiet)
    return 0
