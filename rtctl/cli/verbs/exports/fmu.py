"""`rtctl export fmu --model MODEL --out FILE.fmu`: a model as a functional mock-up unit, for simulators."""

from __future__ import annotations

import argparse


def run(args: argparse.Namespace) -> int:
    """Write the file."""
    from rtctl.api.exporting.fmu import export_fmu
    from rtctl.border.errors import InputError
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.progress import say

    if args.model is None:
        raise InputError("fmu: a model is needed: rtctl export fmu --model MODEL.toml --out FILE.fmu")
    if args.source is not None:
        raise InputError(f"fmu: a unit is made of a model alone, got {args.source}; give --model FILE")
    made = export_fmu(
        args.model,
        output_file(args.out, "a functional mock-up unit", "export fmu", [args.model]),
        version=args.fmi,
        dataset=args.dataset,
        step_s=_step_s(args.step),
        sources_only=args.sources_only,
    )
    if args.json:
        print_json(made.to_dict())
        return 0
    binary = "sources and a binary for this machine" if made.has_binary else "sources alone"
    say(
        f"{made.path}: FMI {made.version} for co-simulation, {len(made.variables)} variables, {binary}\n"
        f"{made.method}, steps of at most {made.longest_step_s:.4g} s; communication step {made.step_s:.4g} s",
        quiet=args.quiet,
    )
    return 0


def _step_s(text: str | None) -> float | None:
    """Return a time [s]. Raises InputError."""
    from rtctl.border.errors import InputError
    from rtctl.border.units.quantities import parse_quantity

    if text is None:
        return None
    try:
        return parse_quantity(text, "s")
    except ValueError as error:
        raise InputError(f"--step: {error}") from None
