"""How far a model is from a dataset: every record simulated from its first sample; DIR/summary.json, Parquet files."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl simulate`."""
    parser.add_argument("model", type=Path, help="model file (model.toml)")
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--no-plot", action="store_true", help="draw no picture of the worst record")


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 1 where a simulation diverged."""
    from rtctl.api.comparison import simulate
    from rtctl.cli.next_step import answer_folder, say_next
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.comparison import print_comparison, warn_of_divergence
    from rtctl.extras import can_draw

    folder = output_folder(args.out)
    comparison = simulate(args.model, args.dataset, out=folder, progress=not is_quiet(args))
    drawn = not args.no_plot and can_draw()
    comparison.save(folder, plot=drawn)
    if args.json:
        print_json(comparison.summary, "simulate")
    elif not args.quiet:
        print_comparison(comparison.summary, folder, drawn=drawn)
    warn_of_divergence(comparison)
    if not comparison.diverged and not is_diagnosed(folder, args.model.parent):
        answer = answer_folder(folder.parent, args.model)
        say_next(args, ["diagnose", args.dataset, "--model", args.model, "--out", answer])
    return 1 if comparison.diverged else 0


def is_diagnosed(*folders: Path) -> bool:
    """Return whether a diagnosis came before: its answer is in one of the folders, or around it."""
    return any((one / "diagnosis.json").exists() for folder in folders for one in (folder, folder.parent))
