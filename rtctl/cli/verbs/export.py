"""A recorded run as a file for other programs, or a loop as sources for other machines.

mcap: a run for PlotJuggler, Foxglove and Lichtblick. c: estimator, controller, limits and guards of a scenario as C99
for a microcontroller (docs/export-c.md).
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

FORMATS = {
    "mcap": "rows, times, changes and events of a run",
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
        "--out", type=Path, required=True, metavar="PATH", help="file, such as run.mcap; c: folder"
    )
    parser.add_argument("--model", type=Path, metavar="MODEL.toml", help="c: the identified model")
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
