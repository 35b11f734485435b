"""Play a scenario in closed loop, or open loop where it has excitations; DIR/summary.json, recording, picture."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtctl.scenario.schema import Scenario


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl run`."""
    parser.add_argument("scenario", help="scenario file, or the name of a bundled one")
    parser.add_argument(
        "--model",
        type=Path,
        help="model file (default: the one that the scenario names; else the device is identified first)",
    )
    parser.add_argument("--out", type=Path, help="folder of the results (default: out/<scenario>)")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="override a key of the scenario, such as --set driver.kind=modbus-tcp",
    )  # fmt: skip
    parser.add_argument(
        "--on", type=Path, metavar="DIR",
        help="folder of `rtctl export c`: the loop runs on an emulated Cortex-M4F, with the device at driver.port",
    )  # fmt: skip
    parser.add_argument("--no-plot", action="store_true", help="draw no picture of the run")


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: passed its checks; 1: fault or checks not met."""
    from rtctl.api.runs import running
    from rtctl.cli.next_step import say_next
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.runs import print_summary
    from rtctl.output.progress import say

    folder = output_folder(args.out or Path("out") / Path(args.scenario).stem)
    if args.on is not None:
        return _run_on_board(args, folder)
    outcome = running.run(
        args.scenario, model=args.model, settings=args.overrides, out=folder, plot=not args.no_plot,
        progress=not is_quiet(args),
    )  # fmt: skip
    if args.json:
        print_json(outcome.summary, "run")
    elif not args.quiet:
        print_summary(outcome.summary, outcome.tuning, folder)
    if outcome.fault is None:
        say_next(args, next_words(outcome.scenario, folder))
    else:
        say(f"rtctl run: {outcome.fault}: {outcome.message}", quiet=False)
    return 0 if outcome.passed else 1


def next_words(scenario: Scenario, folder: Path) -> list[object]:
    """Return the words of the next command: whether the device still is its model, where that can be asked."""
    from rtctl.registry import plant_kind

    is_closed = scenario.reference is not None
    can_be_doubted = is_closed and plant_kind(scenario.scenario.plant).belief is not None
    return ["doubt" if can_be_doubted else "watch", folder]


def _run_on_board(args: argparse.Namespace, folder: Path) -> int:
    """Run with the loop on the emulated board."""
    from rtctl.api.exporting.c import run_on_board
    from rtctl.cli.options import print_json
    from rtctl.cli.printing.runs import print_summary

    result = run_on_board(
        args.scenario, board=args.on, model=args.model, out=folder, settings=args.overrides, plot=not args.no_plot
    )  # fmt: skip
    if args.json:
        print_json(result.summary, "run")
    elif not args.quiet:
        print_summary(result.summary, result.tuning, folder)
    return 0 if result.passed else 1
