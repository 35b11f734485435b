"""What the simulation gets wrong and why: DIR/diagnosis.json, DIR/report.html, DIR/model-extended.toml."""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path

from rtctl.diagnosis.thresholds.budget import BudgetThresholds

WORK = 1e-6 * BudgetThresholds().search
"""Million simulated steps."""
SECONDS = 1800.0
"""Wall-clock guard [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl diagnose`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--model", type=Path, required=True, help="today's model (model.toml)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument(
        "--false-claims", type=float, default=0.05, metavar="RATE",
        help="how often a cause may be claimed where there is none (default 0.05)",
    )  # fmt: skip
    parser.add_argument(
        "--mechanisms", metavar="ID[,ID...]", help="try only these of the catalogue (default: all of them)"
    )
    parser.add_argument(
        "--work", type=float, default=WORK, metavar="MILLION",
        help=f"million simulated steps after which no further fit begins (default {WORK:g})",
    )  # fmt: skip
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, metavar="S",
        help="outer guard of wall-clock time; an answer that it cut depends on the machine and says so "
        f"(default {SECONDS:g})",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 1 where it was stopped; what was done by then is written."""
    from rtctl.border.errors import InputError, RunError
    from rtctl.cli.options import output_folder
    from rtctl.cli.printing.diagnosis import print_diagnosis
    from rtctl.cli.printing.watched_search import watched_search
    from rtctl.diagnosis.diagnose import diagnose
    from rtctl.diagnosis.report.files import provenance_of, write_diagnosis
    from rtctl.diagnosis.search.catalogue_search import DiagnosisOptions
    from rtctl.evaluation.metrics import finite
    from rtctl.measured import open_dataset, read_dataset
    from rtctl.plants.subjects import subject_of
    from rtctl.session.model_validation import simulation_for
    from rtctl.wiring import mechanism_ids

    if not 0.0 < args.false_claims < 0.5:
        raise InputError(f"--false-claims {args.false_claims:g} must be above 0 and below 0.5, such as 0.05")
    if not args.seconds >= 0.0:
        raise InputError(f"--seconds {args.seconds:g} must be 0 or more, such as {SECONDS:g}")
    if not args.work >= 0.0:
        raise InputError(f"--work {args.work:g} must be 0 or more million steps, such as {WORK:g}")
    folder = output_folder(args.out)
    simulation = simulation_for(args.model, open_dataset(args.dataset))
    dataset, model = read_dataset(args.dataset), subject_of(simulation.kind).read_model(args.model)
    ids = _chosen(args.mechanisms, mechanism_ids(simulation.kind))
    options = DiagnosisOptions(false_claim_rate=args.false_claims, work=1e6 * args.work, seconds=args.seconds)
    title, quiet = f"diagnose {dataset.name}", args.quiet or args.json
    with watched_search(title, options.cancellation, quiet=quiet) as report:
        found = diagnose(dataset, model, simulation, ids, options, report)
    provenance = provenance_of(found, dataset, args.model, _command(args))
    failure = ""
    try:
        write_diagnosis(folder, found, dataset, provenance)
    except OSError as error:  # a full disk: minutes of work are told all the same
        failure = f"{folder}: {error.strerror or error}: the files of this answer are not all there"
    if args.json:
        print(json.dumps(finite(found.json | {"provenance": provenance}), indent=2))
    elif not args.quiet or failure:
        print_diagnosis(found, folder, written=not failure)
    if failure:
        raise RunError(f"{failure}; free some space, or write elsewhere with --out")
    return 1 if found.stopped else 0


def _chosen(asked: str | None, known: tuple[str, ...]) -> tuple[str, ...]:
    from rtctl.border.errors import InputError, nearest

    if asked is None:
        return known
    wanted = [name.strip() for name in asked.split(",") if name.strip()]
    for name in wanted:
        if name not in known:
            raise InputError(f'--mechanisms: there is no mechanism "{name}"{nearest(name, known)}')
    if not wanted:
        raise InputError("--mechanisms: name one at least, such as friction.coulomb")
    return tuple(name for name in known if name in wanted)


def _command(args: argparse.Namespace) -> str:
    words = ["rtctl", "diagnose", str(args.dataset), "--model", str(args.model), "--out", str(args.out)]
    words += ["--false-claims", f"{args.false_claims:g}"]
    words += ["--seconds", f"{args.seconds:g}"] if args.seconds != SECONDS else []
    words += ["--work", f"{args.work:g}"] if args.work != WORK else []
    return shlex.join([*words, *(["--mechanisms", args.mechanisms] if args.mechanisms else [])])
