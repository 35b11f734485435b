"""How far a model is from a dataset: every record simulated from its first sample; DIR/summary.json, Parquet files."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl simulate`."""
    parser.add_argument("model", type=Path, help="model file (model.toml)")
    parser.add_argument("dataset", type=Path, help="dataset manifest (dataset.toml)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--no-plot", action="store_true", help="draw no picture of the worst record")


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 1 where a simulation diverged."""
    from rtctl.cli.options import output_folder, stop_on_interrupt
    from rtctl.cli.printing.comparison import draw_worst, print_comparison
    from rtctl.evaluation.metrics import finite, write_json
    from rtctl.measured import open_dataset
    from rtctl.output.progress import progress_bar, say
    from rtctl.session.model_validation import compare_dataset, simulation_for

    folder, quiet = output_folder(args.out), args.quiet or args.json
    dataset = open_dataset(args.dataset)
    simulation = simulation_for(args.model, dataset)
    (folder / "summary.json").unlink(missing_ok=True)  # of an earlier run in the same folder
    with stop_on_interrupt() as stop, progress_bar(dataset.name, len(dataset), quiet=quiet) as advance:
        comparison = compare_dataset(simulation, dataset, folder, stop, advance, source=str(args.model))
    write_json(folder / "summary.json", comparison.summary)
    if not args.no_plot:
        draw_worst(folder / "worst.png", comparison.worst, dataset)
    if args.json:
        print(json.dumps(finite(comparison.summary), indent=2))
    elif not args.quiet:
        print_comparison(comparison.summary, folder)
    for record, diverged_at_s in comparison.diverged:
        say(
            f"rtctl simulate: record {record} diverged {diverged_at_s:.6g} s after its first sample: the model has "
            "no bound there; check the signs and units of its stiffnesses",
            quiet=False,
        )
    return 1 if comparison.diverged else 0
