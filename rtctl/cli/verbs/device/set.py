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
    from rtctl.api.runs.recordings import change_in_words
    from rtctl.cli.options import print_json
    from rtctl.output.progress import say

    taken = change_in_words(args.run, args.change)
    if args.json:
        print_json(taken._asdict())
        return 0
    say(taken.in_words(), quiet=args.quiet)
    return 0
