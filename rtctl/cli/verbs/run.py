"""Play a scenario in closed loop, or open loop where it has excitations; DIR/summary.json, recording, picture."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl run`."""
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


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 0: passed its checks; 1: fault or checks not met."""
    from rtctl.cli.options import output_folder, watched_run
    from rtctl.cli.printing.runs import print_summary
    from rtctl.loop.live_parameters import ParameterChannel
    from rtctl.output.progress import say
    from rtctl.scenario.bundled import find_scenario
    from rtctl.scenario.command_sequence import steps_of
    from rtctl.scenario.schema import load_scenario
    from rtctl.session.closed_loop import track
    from rtctl.session.control_socket import listening
    from rtctl.session.run_files import write_run
    from rtctl.session.run_folder import RunFolder, run_metadata
    from rtctl.wiring import build_driver, model_of, model_path, needs_model, unused_extensions

    path = find_scenario(args.scenario)
    scenario, tables = load_scenario(path, args.overrides)
    folder = output_folder(args.out or Path("out") / path.stem)
    quiet = args.quiet or args.json
    driver = build_driver(scenario, path.parent)
    with watched_run(scenario.scenario.title, steps_of(scenario), quiet=quiet) as stop_requested:
        model, model_file = (
            model_of(scenario, path.parent, args.model),
            model_path(scenario, path.parent, args.model),
        )
        if model is None and needs_model(scenario):
            from rtctl.cli.identify_first import identify_first

            say("no --model given: identifying the device first", quiet=quiet)
            model = identify_first(scenario, driver, folder, stop_requested, quiet=quiet)
            model_file = folder / "model.toml"
            driver = build_driver(scenario, path.parent)
        run_folder = RunFolder(
            path=folder,
            metadata=run_metadata(tables),
            model=model_file,
            report=lambda text: say(text, quiet=quiet),
        )
        unused = unused_extensions(scenario, model)
        if unused:
            say(f"does not change the loop: {', '.join(unused)}", quiet=quiet)
        changes = ParameterChannel()
        with listening(folder, changes):
            result, outcome = track(scenario, model, driver, stop_requested, run_folder, changes)
    write_run(folder, scenario, tables, result)
    if args.json:
        print(json.dumps(result.summary, indent=2))
    elif not args.quiet:
        print_summary(result.summary, result.tuning, folder)
    if outcome.fault is not None:
        say(f"rtctl run: {outcome.fault}: {outcome.message}", quiet=False)
    return 0 if result.summary["verdict"] == "pass" else 1
