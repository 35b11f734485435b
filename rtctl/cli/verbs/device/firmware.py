"""Sources of a device on a microcontroller, with the film of a simulated device, into a folder: docs/firmware.md."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl firmware`."""
    parser.add_argument(
        "film", nargs="?", default="vo2_a", metavar="PLANT",
        help="VO2 plant file, or the name of a bundled one, whose film the boards without a film simulate "
        "(default: vo2_a)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder of the sources")
    parser.add_argument("--force", action="store_true", help="overwrite sources that are there")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.exporting.firmware import write_sources
    from rtctl.cli.options import output_folder, print_json

    folder = output_folder(args.out)
    name = write_sources(folder, args.film, force=args.force)
    if args.json:
        print_json({"folder": str(folder), "film": name})
    elif not args.quiet:
        print(f"firmware with the film {name}: {folder}")
        print(f"for this computer: make -C {folder} host && {folder}/build/rtctl_host /tmp/vo2")
        print(f"for an emulated Cortex-M4F: make -C {folder} emulate")
        print(
            f"for Arduino and Teensy: {folder}/examples/rtctl_vo2 with {folder} as a library (docs/firmware.md)"
        )
    return 0
