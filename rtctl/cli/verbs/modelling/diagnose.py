"""What the simulation gets wrong and why: DIR/diagnosis.json, DIR/report.html, DIR/model-extended.toml."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.api.diagnosis_defaults import SECONDS, WORK

if TYPE_CHECKING:
    from rtctl.api.diagnosing import Diagnosis

MILLION = 1e6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl diagnose`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument(
        "--model",
        type=Path,
        help="model to diagnose (model.toml); without one it is identified first: DIR/model.toml",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument(
        "--false-claims", type=float, default=0.05, metavar="RATE",
        help="how often a cause may be claimed where there is none (default 0.05)",
    )  # fmt: skip
    parser.add_argument(
        "--mechanisms", metavar="ID[,ID...]", help="try only these of the catalogue (default: all of them)"
    )
    parser.add_argument(
        "--work", type=float, default=WORK / MILLION, metavar="MILLION",
        help=f"million simulated steps after which no further fit begins (default {WORK / MILLION:g})",
    )  # fmt: skip
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, metavar="S",
        help="outer guard of wall-clock time; an answer that it cut depends on the machine and says so "
        f"(default {SECONDS:g})",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 1 where it was stopped; what was done by then is written."""
    from rtctl.api.diagnosing import check_mechanisms, diagnose
    from rtctl.border.errors import RunError
    from rtctl.cli.next_step import say_next
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.diagnosis import print_diagnosis

    if args.mechanisms is not None and args.model is None:
        check_mechanisms(args.mechanisms, args.dataset)
    folder = output_folder(args.out)
    check_output(args, folder)
    model = args.model or identified(args, folder / "model.toml")
    diagnosis = diagnose(
        args.dataset, model, mechanisms=args.mechanisms, false_claim_rate=args.false_claims,
        work=MILLION * args.work, seconds=args.seconds, progress=not is_quiet(args),
    )  # fmt: skip
    failure = ""
    try:
        diagnosis.save(folder)
    except OSError as error:  # a full disk: minutes of work are printed all the same
        failure = f"{folder}: {error.strerror or error}: the files of this answer are not all there"
    if args.json:
        print_json(diagnosis.to_dict(folder))
    elif not args.quiet or failure:
        print_diagnosis(diagnosis.answer, folder, written=not failure)
    if failure:
        raise RunError(f"{failure}; free some space, or write elsewhere with --out")
    say_next_experiment(args, diagnosis, folder)
    say_next(args, next_words(diagnosis, args, folder), diagnosis.answer.correction)
    return 1 if diagnosis.stopped else 0


def check_output(args: argparse.Namespace, folder: Path) -> None:
    """Raise InputError where the answer would replace a file that is read or that no diagnosis wrote."""
    from rtctl.cli.options import output_file
    from rtctl.diagnosis.report.files import NAMES

    sources = [args.dataset, *([] if args.model is None else [args.model])]
    for name in NAMES:
        output_file(folder / name, "a file of the answer", "diagnose", sources)
    if args.model is None:
        for name in ("model.toml", "model.png"):
            output_file(folder / name, "a file of the answer", "identify", sources)


def identified(args: argparse.Namespace, out: Path) -> Path:
    """Identify the nominal model of the dataset, write and print it, also one that the data do not follow yet."""
    from rtctl.api.identifying.identification import identify
    from rtctl.cli.options import is_quiet
    from rtctl.cli.printing.fits import print_fit
    from rtctl.extras import can_draw

    draws = can_draw()
    fit = identify(args.dataset, progress=not is_quiet(args)).save(out, plot=draws)
    if not (args.quiet or args.json):
        print_fit(fit, out, out.with_suffix(".png") if draws else None)
    return out


def say_next_experiment(args: argparse.Namespace, diagnosis: Diagnosis, folder: Path) -> None:
    """Print how to play the next experiment of data that are files of the user's, whose device rtctl does not drive."""
    from rtctl.diagnosis.report.files import how_to_play

    proposed = diagnosis.next_experiment
    if args.quiet or args.json or proposed is None or not proposed.decides or diagnosis.dataset.is_acquired:
        return
    print(f"next experiment: {how_to_play(diagnosis.dataset, folder, str(folder / 'rehearsal'))}")


def next_words(diagnosis: Diagnosis, args: argparse.Namespace, folder: Path) -> list[object]:
    """Return the words of the next command: the experiment that decides, else the extended model beside the data.

    An experiment is a command only for data that rtctl acquire recorded. Where the manifest is to be corrected, the
    command is to identify again, which a diagnosis without a model does itself.
    """
    if diagnosis.answer.doubt:
        return []
    if diagnosis.answer.correction and args.model is None:
        return ["diagnose", args.dataset, "--out", folder]
    if diagnosis.answer.correction:
        is_start = args.model.resolve() == (folder / "model.toml").resolve()
        out = folder / ("model-corrected.toml" if is_start else "model.toml")
        return ["identify", args.dataset, "--model", args.model, "--out", out]
    proposed = diagnosis.next_experiment
    if proposed is not None and proposed.decides and diagnosis.dataset.is_acquired:
        return ["acquire", folder / "next-experiment.toml", "--out", folder / "next"]
    if diagnosis.model is not None:
        return ["simulate", folder / "model-extended.toml", args.dataset, "--out", folder / "simulated"]
    if diagnosis.verdict == "adequate":
        return ["simulate", args.model or folder / "model.toml", args.dataset, "--out", folder / "simulated"]
    return []
