"""A paper's study on our plants, its figures beside ours: DIR/report.html, DIR/report.md, DIR/results.json."""

from __future__ import annotations

import argparse
import importlib
import json
import shlex
from pathlib import Path

STUDIES: tuple[str, ...] = ("vo2", "me", "bistable")
"""Each a package of that name in `rtctl.reproduce`, whose `study.py` has a `STUDY`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl reproduce`."""
    parser.add_argument("study", choices=STUDIES, help="which paper's")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the report; a stopped study goes on there"
    )
    parser.add_argument(
        "--short", action="store_true", help="fewer seeds and shorter records: a look in seconds"
    )


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from datetime import date

    from rtctl import __version__
    from rtctl.cli.options import output_folder
    from rtctl.extras import require
    from rtctl.output.progress import say
    from rtctl.reproduce.report import write_report
    from rtctl.reproduce.run import run_study

    require("matplotlib", "rtctl reproduce")
    folder = output_folder(args.out)
    study = importlib.import_module(f"rtctl.reproduce.{args.study}.study").STUDY
    quiet = args.quiet or args.json
    sections = run_study(
        study,
        folder,
        short=args.short,
        report=lambda line: say(f"reproduce {args.study}: {line}", quiet=quiet),
    )
    words = ["rtctl", "reproduce", args.study, "--out", str(args.out), *(["--short"] if args.short else [])]
    write_report(study, sections, folder, shlex.join(words), f"{date.today():%Y-%m-%d}, rtctl {__version__}")
    if args.json:
        print(json.dumps(json.loads((folder / "results.json").read_text(encoding="utf-8")), indent=2))
    elif not args.quiet:
        print(f"report in {folder / 'report.html'}")
    return 0
