"""What was read of a dataset: a table of signals and records, and a picture of all of them."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl preview`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--out", type=Path, metavar="FILE.png", help="picture to write (default: none)")


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.first_look.preview import preview
    from rtctl.cli.next_step import say_next
    from rtctl.cli.options import output_file, print_json
    from rtctl.cli.printing.first_look import print_preview

    out = None if args.out is None else output_file(args.out, "a picture (PNG)", "preview")
    shown = preview(args.dataset)
    picture = None if out is None else shown.save(out)
    if args.json:
        print_json({**shown.to_dict(), "picture": None if picture is None else str(picture)})
    elif not args.quiet:
        print_preview(shown)
        if picture is not None:
            print(f"wrote {picture}")
    if shown.summary.plant != "equations":  # which need a model file, whose name only the user knows
        say_next(args, ["diagnose", args.dataset, "--out", args.dataset.parent / "answer"])
    return 0
