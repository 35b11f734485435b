"""Play an open-loop excitation through the driver and write a dataset (DIR/dataset.toml)."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl acquire`."""
    parser.add_argument(
        "scenario", help="scenario file with [[excitation]] tables, or a bundled name: acquire_vo2"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the dataset")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="override a key of the scenario, such as --set driver.kind=modbus-tcp",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from rtctl.cli.options import output_folder, watched_run
    from rtctl.measured.backup import put_aside
    from rtctl.output.progress import say
    from rtctl.scenario.bundled import find_scenario
    from rtctl.scenario.command_sequence import steps_of
    from rtctl.scenario.schema import load_scenario
    from rtctl.session.acquisition import acquire
    from rtctl.wiring import build_driver

    path, folder = find_scenario(args.scenario), output_folder(args.out)
    scenario, _ = load_scenario(path, args.overrides)
    driver = build_driver(scenario, path.parent)
    quiet = args.quiet or args.json

    def make_room() -> None:
        if (aside := put_aside(folder)) is not None:
            say(f"{folder} held a dataset: it was moved to {aside}", quiet=quiet)

    with watched_run(scenario.scenario.title, steps_of(scenario), quiet=quiet) as stop_requested:
        manifest = acquire(
            scenario, driver, folder, stop_requested, lambda text: say(text, quiet=quiet), make_room
        )
    if args.json:
        print(json.dumps({"dataset": str(manifest), "device": driver.identity}))
    else:
        say(f"wrote {manifest}", quiet=quiet)
    return 0
