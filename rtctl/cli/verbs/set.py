"""Change the set-point or a gain of a run that is under way; recorded with its sample among the run's events."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl set`."""
    parser.add_argument("run", type=Path, help="folder into which the run records (its --out)")
    parser.add_argument(
        "change",
        metavar="NAME=VALUE",
        help='setpoint="30 um" (in the unit of the scenario\'s output if none is given), setpoint=plan, '
        "controller.kp=0.02, controller.ki=8",
    )


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 0: the run has taken it and applies it at its next step."""
    import json

    from rtctl.output.progress import say
    from rtctl.session.control_socket import read_change, send

    change = read_change(args.run, args.change)
    send(args.run, change.name, change.value)
    if args.json:
        print(
            json.dumps({"name": change.name, "value": change.value if change.value == change.value else None})
        )
    else:
        say(f"{args.change}: applied at the next step, see {args.run / 'events.jsonl'}", quiet=args.quiet)
    return 0
