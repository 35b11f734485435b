"""A recorded run or a model as a file for other programs, or a loop as sources for other machines.

mcap: a run for PlotJuggler, Foxglove and Lichtblick. fmu: a model for simulators (docs/export-fmu.md). c: estimator,
controller, limits and guards of a scenario as C99 for a microcontroller (docs/export-c.md).
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

FORMATS = {
    "mcap": "rows, times, changes and events of a run",
    "fmu": "a model as a functional mock-up unit (FMI), for simulators",
    "c": "the loop of a scenario as C99 for a microcontroller",
}
"""What each format is; its module below `rtctl.cli.verbs.exports` has its name."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl export`."""
    what = "; ".join(f"{name}: {text}" for name, text in FORMATS.items())
    parser.add_argument("format", choices=tuple(FORMATS), help=what)
    parser.add_argument(
        "source", metavar="SOURCE", type=Path, nargs="?",
        help="mcap: folder of a run (its --out), under way, ended or killed",
    )  # fmt: skip
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="PATH",
        help="file, such as run.mcap or model.fmu; c: folder",
    )
    parser.add_argument(
        "--model", type=Path, metavar="MODEL.toml", help="fmu: the model; c: the identified one"
    )
    parser.add_argument("--fmi", choices=("3.0", "2.0"), default="3.0", help="fmu: version of FMI (3.0)")
    parser.add_argument(
        "--dataset", type=Path, metavar="DATASET",
        help="fmu: manifest of records that it shall integrate as `rtctl simulate` does",
    )  # fmt: skip
    parser.add_argument(
        "--step", metavar="TIME",
        help='fmu: communication step that it proposes, such as "1 ms" (the sample period of --dataset)',
    )  # fmt: skip
    parser.add_argument("--sources-only", action="store_true", help="fmu: compile no binary for this machine")
    parser.add_argument("--scenario", metavar="SCENARIO", help="c: scenario file or bundled name")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="c: override a key of the scenario",
    )  # fmt: skip
    parser.add_argument(
        "--extrema", type=int, default=64, metavar="N",
        help="c: turning points that each Preisach memory keeps (default: 64, 8 bytes each)",
    )  # fmt: skip
    parser.add_argument("--force", action="store_true", help="c: overwrite sources that are there")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    return int(importlib.import_module(f"rtctl.cli.verbs.exports.{args.format}").run(args))
