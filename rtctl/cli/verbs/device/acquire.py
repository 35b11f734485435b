"""Play an open-loop excitation through the driver and write a dataset (DIR/dataset.toml)."""

from __future__ import annotations

import argparse
from pathlib import Path

ON_A_WIRE = "--set driver.kind=modbus-tcp --set driver.address=HOST:PORT"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl acquire`."""
    parser.add_argument(
        "scenario", help="scenario file with [[excitation]] tables, or a bundled name: acquire_vo2"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the dataset")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="override a key of the scenario, such as --set driver.kind=modbus-tcp",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.acquisition import acquire
    from rtctl.cli.next_step import say_next
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.output.progress import say
    from rtctl.registry import plant_kind

    folder = output_folder(args.out)
    dataset = acquire(args.scenario, folder, settings=args.overrides, progress=not is_quiet(args))
    if args.json:
        print_json({"dataset": str(dataset.path), "device": dataset.identity})
    else:
        say(f"wrote {dataset.path}{_simulated(args)}", quiet=args.quiet)
    if plant_kind(dataset.plant).identification is not None:
        start = _model_words(args) if plant_kind(dataset.plant).free_signals else []
        say_next(args, ["identify", dataset.path, *start, "--out", dataset.path.parent / "model.toml"])
    return 0


def _simulated(args: argparse.Namespace) -> str:
    """Return the sentence that says of data of a simulated device what they are; "" of any other device."""
    from rtctl.api.inputs import load_scenario
    from rtctl.diagnosis.report.rehearsed_device import left_out_of
    from rtctl.scenario.drivers import InProcess

    loaded = load_scenario(args.scenario, args.overrides)
    driver = loaded.scenario.driver
    if not isinstance(driver, InProcess):
        return ""
    device = driver.device or loaded.scenario.scenario.plant
    text = f". These data are simulated, by the device {device}. Your own device: {ON_A_WIRE}"
    path = loaded.folder / device
    left_out = left_out_of(path) if path.suffix == ".toml" and path.is_file() else ()
    if left_out:
        text += (
            f". The device leaves out {', '.join(left_out)}, which the diagnosed model has: it takes one sample after "
            "the other, and holds each command"
        )
    return text


def _model_words(args: argparse.Namespace) -> list[object]:
    """Return the option that starts an identification at the model whose equations the device has."""
    from rtctl.api.inputs import load_scenario

    loaded = load_scenario(args.scenario, args.overrides)
    named = loaded.scenario.scenario.model
    return [] if named is None else ["--model", loaded.folder / named]
