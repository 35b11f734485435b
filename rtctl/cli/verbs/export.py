"""A run or a model in a form that other programs take: mcap (a run), fmu (a model, for simulators)."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple


class Format(NamedTuple):
    """A form of export."""

    needs: str
    """Name of the argument that it is made of."""
    run: Callable[[argparse.Namespace], int]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl export`."""
    parser.add_argument(
        "format",
        choices=tuple(FORMATS),
        help="mcap: rows, times, changes and events of a RUN; fmu: a --model as a functional mock-up unit (FMI)",
    )
    parser.add_argument(
        "source", metavar="RUN", type=Path, nargs="?",
        help="mcap: folder of a run (its --out), under way, ended or killed",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="such as run.mcap or model.fmu"
    )
    parser.add_argument("--model", type=Path, help="fmu: model file (model.toml)")
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


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.border.errors import InputError

    form = FORMATS[args.format]
    if getattr(args, form.needs) is None:
        what = "RUN, the folder of a run" if form.needs == "source" else f"--{form.needs} FILE"
        raise InputError(f"{args.format} is made of {what}; none was given")
    if form.needs != "source" and args.source is not None:
        raise InputError(f"{args.format} takes no RUN, got {args.source}; give --{form.needs} FILE")
    return form.run(args)


def _mcap(args: argparse.Namespace) -> int:
    from rtctl.api.recordings import export_mcap
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.progress import say

    rows = export_mcap(args.source, output_file(args.out, "an MCAP file"))
    if args.json:
        print_json({"file": str(args.out), "rows": rows})
    else:
        say(f"{args.out}: {rows} rows", quiet=args.quiet)
    return 0


def _fmu(args: argparse.Namespace) -> int:
    from rtctl.api.exporting.fmu import export_fmu
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.progress import say

    made = export_fmu(
        args.model,
        output_file(args.out, "a functional mock-up unit"),
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
    from rtctl.border.quantities import parse_quantity

    if text is None:
        return None
    try:
        return parse_quantity(text, "s")
    except ValueError as error:
        raise InputError(f"--step: {error}") from None


FORMATS = {"mcap": Format("source", _mcap), "fmu": Format("model", _fmu)}
"""Forms of export by name."""
