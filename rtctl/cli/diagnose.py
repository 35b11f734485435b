"""What the simulation gets wrong and why: DIR/diagnosis.json, DIR/report.html, DIR/model-extended.toml."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl diagnose`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--model", type=Path, required=True, help="today's model (model.toml)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument(
        "--false-claims", type=float, default=0.05, metavar="RATE",
        help="how often a cause may be claimed where there is none (default 0.05)",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from rtctl.border.errors import InputError
    from rtctl.cli.options import output_folder
    from rtctl.cli.report_diagnosis import print_diagnosis
    from rtctl.comparison import simulation_for
    from rtctl.diagnosis.diagnose import DiagnosisOptions, diagnose
    from rtctl.diagnosis.files import write_diagnosis
    from rtctl.measured import open_dataset, read_dataset
    from rtctl.metrics import finite
    from rtctl.models.oscillator import read_oscillator_model
    from rtctl.progress import say
    from rtctl.wiring import mechanism_ids

    if not 0.0 < args.false_claims < 0.5:
        raise InputError(f"--false-claims {args.false_claims:g} must be above 0 and below 0.5, such as 0.05")
    folder = output_folder(args.out)
    simulation = simulation_for(args.model, open_dataset(args.dataset))
    dataset, model = read_dataset(args.dataset), read_oscillator_model(args.model)
    quiet = args.quiet or args.json
    found = diagnose(
        dataset, model, simulation, mechanism_ids(model.kind),
        DiagnosisOptions(false_claim_rate=args.false_claims), lambda text: say(f"  {text}", quiet=quiet),
    )  # fmt: skip
    write_diagnosis(folder, found, dataset, args.model)
    if args.json:
        print(json.dumps(finite(found.json), indent=2))
    elif not args.quiet:
        print_diagnosis(found, folder)
    return 0
