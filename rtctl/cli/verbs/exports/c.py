"""`rtctl export c --scenario SCENARIO --model MODEL --out DIR`: the loop as C99 for a microcontroller."""

from __future__ import annotations

import argparse
from dataclasses import asdict


def run(args: argparse.Namespace) -> int:
    """Write the folder."""
    from rtctl.api.exporting.c import export_c
    from rtctl.border.errors import InputError
    from rtctl.cli.options import output_folder, print_json

    scenario = args.scenario or args.source
    if scenario is None:
        raise InputError(
            "c: a scenario is needed: rtctl export c --scenario steps --model MODEL.toml --out DIR"
        )
    folder = output_folder(args.out)
    if folder.exists() and any(folder.iterdir()) and not args.force:
        raise InputError(
            f"--out {folder}: is not empty; choose a new folder, or --force to overwrite sources"
        )
    made = export_c(
        str(scenario),
        model=args.model,
        out=folder,
        settings=args.overrides,
        extrema=args.extrema,
        force=args.force,
    )
    if args.json:
        print_json({**asdict(made), "folder": str(made.folder)})
    elif not args.quiet:
        print(
            f"{made.folder}: {made.functions} functions of the {made.estimator} loop; in single precision "
            f"{made.table_bytes} bytes of tables and {made.state_bytes} bytes of memory"
        )
        print(f"compile: make -C {made.folder} host; make -C {made.folder} m4f")
        print(f"prove it on a run: rtctl replay RUN --export {made.folder}")
    return 0
