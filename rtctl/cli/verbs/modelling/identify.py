"""Measured data -> model: an oscillator's or equations' parameters with errors, or a VO2 film's loops and heating."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl identify`."""
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument(
        "--kind", help="which kind of plant: oscillator, vo2 or equations (default: the dataset's own)"
    )
    parser.add_argument("--out", type=Path, required=True, help="model file to write")
    parser.add_argument(
        "--model",
        type=Path,
        help="oscillator and equations only: model file with start values, fixed parameters and mechanisms",
    )
    parser.add_argument("--plays", type=int, help="VO2 only: play operators per model (default 6)")
    parser.add_argument(
        "--cells",
        type=int,
        help="VO2 only: cells along an edge of the fine Preisach models, 8 to 80 (default 80)",
    )
    parser.add_argument(
        "--starts", type=int, help="number of random starts of each fit (default 14 for VO2, else 6)"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the random starts (default 0)")
    parser.add_argument("--no-plot", action="store_true", help="write no picture beside the model")


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 1 where the model does not follow the data."""
    from rtctl.api.identifying.identification import identify
    from rtctl.border.errors import InputError
    from rtctl.cli.next_step import answer_folder, say_next
    from rtctl.cli.options import is_quiet, output_file, print_json
    from rtctl.cli.printing.fits import print_fit
    from rtctl.extras import can_draw

    draws = not args.no_plot and can_draw()
    start = [] if args.model is None else [args.model]
    out = output_file(args.out, "a model file", "identify", [args.dataset, *start])
    if draws and out.suffix == ".png":
        raise InputError(
            f"--out {out}: a model file is needed, and its picture has that name; call it {out.stem}.toml"
        )
    if draws:
        output_file(out.with_suffix(".png"), "a picture", "identify", [args.dataset])
    fit = identify(
        args.dataset, kind=args.kind, model=args.model, starts=args.starts, seed=args.seed,
        plays=args.plays, cells=args.cells, progress=not is_quiet(args),
    )  # fmt: skip
    fit = fit.save(out, plot=draws)
    if args.json:
        print_json({"model": str(out), **fit.to_dict()})
    elif not args.quiet:
        print_fit(fit, out, out.with_suffix(".png") if draws else None)
    if fit.correction:
        begin = ["--model", args.model] if start else []
        say_next(args, ["identify", args.dataset, *begin, "--out", out], fit.correction)
    elif is_diagnosed_next(fit.model.kind, trusted=fit.trusted):
        say_next(args, ["diagnose", args.dataset, "--model", out, "--out", answer_folder(out.parent, out)])
    return 0 if fit.trusted else 1


def is_diagnosed_next(kind: str, *, trusted: bool) -> bool:
    """Return whether a diagnosis is the next step: not where a note says how to acquire better data first."""
    from rtctl.registry import plant_kind

    record = plant_kind(kind)
    acquires = record.identification is not None and bool(record.identification.excitation)
    return record.diagnosis is not None and (trusted or not acquires)
