"""Measured data -> model: an oscillator's parameters with errors, or a vo2's hysteresis read-outs and heating."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

TOO_COARSE = (
    "the static loops are too coarse, relays switch together: of the staircases, as many cells placed where they do "
    "leave {}; rtctl diagnose learns them anew where records to fit show where they switch"
)
STILL_MOVING = 0.02
"""What is left of a first-order heating is known (up to 1.3 % of the bundled devices), of a delay it is not."""
UNSETTLED = (
    "at the ends of the holds of record {} a sample still brings {:.1%} of a step: the loops identified from it are "
    'off by several times that; hold longer, such as --set "excitation.0.hold=30 ms" of rtctl acquire'
)
DEFAULT_STARTS = {"vo2": 14, "oscillator": 6}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl identify`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--kind", choices=["vo2", "oscillator"], required=True, help="which kind of plant")
    parser.add_argument("--out", type=Path, required=True, help="model file to write")
    parser.add_argument(
        "--model",
        type=Path,
        help="of an oscillator: where to start, which parameters are fixed, its mechanisms",
    )
    parser.add_argument("--plays", type=int, default=6, help="of a vo2: play operators a model (default 6)")
    parser.add_argument(
        "--cells",
        type=int,
        default=80,
        help="of a vo2: cells along an edge of the fine Preisach models, 8 to 80 (default 80)",
    )
    parser.add_argument(
        "--starts", type=int, help="starts of each fit (default 14 for a vo2, 6 for an oscillator)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the starts (default 0)")
    parser.add_argument("--no-plot", action="store_true", help="write no picture beside the model")


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from rtctl.border.errors import InputError
    from rtctl.cli.options import output_folder

    if args.starts is None:
        args.starts = DEFAULT_STARTS[args.kind]
    for option in ("plays", "starts"):
        if not 1 <= getattr(args, option) <= 64:
            raise InputError(f"--{option} {getattr(args, option)}: 1 to 64")
    if not 8 <= args.cells <= 80:
        raise InputError(f"--cells {args.cells}: 8 to 80")
    output_folder(args.out.parent)
    if args.out.is_dir():
        raise InputError(f"--out {args.out}: is a folder, a model file is needed")
    if args.kind == "oscillator":
        from rtctl.cli.printing.oscillator_fit import run_oscillator

        return run_oscillator(args)
    if args.model is not None:
        raise InputError(f"--model {args.model}: a vo2 is identified from its data alone; leave it out")
    return _run_vo2(args)


def _run_vo2(args: argparse.Namespace) -> int:
    from rtctl import __version__
    from rtctl.cli.printing.runs import print_model
    from rtctl.identification.vo2.coarse_loops import describe_improvement, find_coarse_loops
    from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
    from rtctl.identification.vo2.staircase import estimate_unsettled_share
    from rtctl.measured.reading import read_dataset
    from rtctl.models.vo2 import write_model
    from rtctl.output.progress import say

    quiet = args.quiet or args.json
    dataset = read_dataset(args.dataset)
    options = Vo2FitOptions(plays=args.plays, starts=args.starts, fine_cells=args.cells, seed=args.seed)
    model = identify_vo2(dataset, options, lambda text: say(text, quiet=quiet))
    model = model.with_provenance(
        dataset=dataset.name, version=__version__, command="rtctl identify --kind vo2"
    )
    write_model(model, args.out)
    if not args.no_plot:
        from rtctl.cli.printing.runs import draw_model

        draw_model(args.out.with_suffix(".png"), dataset, model)
    say("whether the static loops are too coarse", quiet=quiet)
    coarse = find_coarse_loops(model, dataset)
    notes = [TOO_COARSE.format(describe_improvement(coarse))] if coarse else []
    for record in (one for one in dataset.records if one.use == "identify"):
        if (share := estimate_unsettled_share(record)) > STILL_MOVING:
            notes.append(UNSETTLED.format(record.name, share))
    if args.json:
        quality = {name: q._asdict() for name, q in model.quality.items()}
        print(json.dumps({"model": str(args.out), "quality": quality, "warnings": notes}))
    elif not args.quiet:
        print_model(model, args.out)
        for note in notes:
            print(f"note: {note}")
    return 0
