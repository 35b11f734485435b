"""The whole job on simulated hardware: serve, acquire, identify, every scenario over the wire, one table."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl demo`."""
    parser.add_argument("--device", default="vo2_a", help="plant file or bundled name (default vo2_a)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder of the results")
    parser.add_argument(
        "--seed", type=int, default=1, help="seed of the simulated device's noise (default 1)"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 1 where a scenario misses its checks."""
    from rtctl.api.machines import demonstrate
    from rtctl.cli.options import is_quiet, output_folder, print_json
    from rtctl.cli.printing.runs import print_scenarios
    from rtctl.session.run_folder import watch_words

    summaries = demonstrate(args.device, output_folder(args.out), seed=args.seed, progress=not is_quiet(args))
    if args.json:
        print_json(summaries)
    elif not args.quiet:
        print_scenarios(summaries)
        print(f"pictures, recordings and summaries in {args.out}/<scenario>/, model in {args.out}/model.toml")
        print(watch_words(args.out))
    return 0 if all(summary["verdict"] == "pass" for summary in summaries) else 1
