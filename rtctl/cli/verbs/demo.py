"""The whole job on simulated hardware: serve, acquire, identify, every scenario over the wire, one table."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl demo`."""
    parser.add_argument("--device", default="vo2_a", help="plant file or bundled name (default vo2_a)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder of the results")
    parser.add_argument("--seed", type=int, default=1, help="of the simulated device's noise (default 1)")


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 1 where a scenario misses its checks."""
    from rtctl.cli.options import output_folder
    from rtctl.cli.printing.runs import print_scenarios
    from rtctl.output.interrupt import stop_on_interrupt
    from rtctl.output.progress import say
    from rtctl.session.demo import demonstrate

    quiet = args.quiet or args.json
    with stop_on_interrupt() as stop_requested:
        summaries = demonstrate(
            args.device,
            args.seed,
            output_folder(args.out),
            stop_requested,
            lambda text: say(text, quiet=quiet),
        )
    if args.json:
        print(json.dumps(summaries, indent=2))
    elif not args.quiet:
        print_scenarios(summaries)
        print(f"pictures, recordings and summaries in {args.out}/<scenario>/, model in {args.out}/model.toml")
    return 0 if all(summary["verdict"] == "pass" for summary in summaries) else 1
