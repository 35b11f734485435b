"""Data files -> manifest: columns, units, rate, roles guessed, asked or refused; DIR/dataset.toml, DIR/preview.png."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl init`."""
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="data files of one kind, in any format"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the manifest (default: that of the first file)"
    )
    parser.add_argument(
        "--yes", action="store_true", help="ask nothing: take the guesses, refuse where there is none"
    )
    parser.add_argument(
        "--plant", metavar="KIND", help="what was measured: oscillator, vo2 or equations (default: guessed)"
    )
    parser.add_argument(
        "--model", type=Path, metavar="MODEL.toml",
        help="model that the data are for; a model of equations names the inputs and outputs for --input and --output",
    )  # fmt: skip
    parser.add_argument(
        "--input", dest="inputs", action="append", default=[], metavar="[NAME=]COLUMN[:UNIT]",
        help="column that drives the plant, and its unit, such as --input u:V; - for none; with equations "
        "NAME=COLUMN:UNIT",
    )  # fmt: skip
    parser.add_argument(
        "--output", dest="outputs", action="append", default=[], metavar="NAME=COLUMN[:UNIT]",
        help="column of a response, such as --output displacement=x:mm; NAME=- for none; may be given several times",
    )  # fmt: skip
    parser.add_argument(
        "--scale", dest="scales", action="append", default=[], metavar="NAME='NUMBER UNIT'",
        help="transducer of a signal: its sensitivity, such as --scale 'drive=22.4 mV/N', or scale, 44.6 N/V",
    )  # fmt: skip
    parser.add_argument(
        "--time", metavar="COLUMN[:UNIT]", help="time column, such as --time t:ms; - for none"
    )
    parser.add_argument(
        "--sample-rate", type=float, metavar="HZ", help="sample rate, instead of a time column"
    )
    parser.add_argument(
        "--drive-amplitude", metavar="'NUMBER UNIT'",
        help="sweeps only: amplitude of the drive if the files do not tell it, such as '20 mV' or '20 mV rms'",
    )  # fmt: skip
    parser.add_argument(
        "--hold", metavar="HOLD", help="how the drive goes on between samples: linear, zero or band-limited"
    )
    parser.add_argument(
        "--test", metavar="FILE", help="file that no fit uses; or last-third, none (default: guessed)"
    )
    parser.add_argument("--name", help="name of the dataset (default: that of the file or its folder)")
    parser.add_argument("--no-plot", action="store_true", help="draw no picture")
    parser.add_argument(
        "--force", action="store_true", help="overwrite a manifest and a picture that are there"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from rtctl.api.first_look.initiation import paths_of, signals_of_model, target_folder, write_proposal
    from rtctl.cli.dialogue import ask_all, is_terminal
    from rtctl.cli.next_step import say_next
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.first_look import print_initiation
    from rtctl.measured.proposal.asking.refusal import refuse_open
    from rtctl.measured.proposal.grouped import by_groups
    from rtctl.measured.proposal.proposal import Answers
    from rtctl.measured.proposal.propose import propose
    from rtctl.measured.proposal.survey import survey_files

    answers = Answers(
        plant=args.plant, inputs=tuple(args.inputs), outputs=tuple(args.outputs), scales=tuple(args.scales),
        time=args.time, sample_rate_hz=args.sample_rate, hold=args.hold, test=args.test, name=args.name,
        drive_amplitude=args.drive_amplitude,
        model=None if args.model is None else signals_of_model(args.model),
    )  # fmt: skip
    paths = paths_of(args.files)
    surveys = by_groups(survey_files(paths), answers)
    folder = target_folder(paths, args.out, force=args.force)
    asks = is_terminal() and not args.yes and not is_quiet(args)
    if not (asks or args.yes or is_quiet(args)):
        print("no terminal: nothing is asked, and the guesses are taken as with --yes", file=sys.stderr)
    proposal = ask_all(surveys, answers) if asks else propose(surveys, answers)
    refuse_open(proposal, [str(path) for path in paths], answers)
    output_folder(folder)
    found = write_proposal(proposal, folder, plot=not args.no_plot)
    if args.json:
        print_json(found.to_dict())
    elif not args.quiet:
        print_initiation(found)
    say_next(args, found.next_command[1:])
    return 0
