"""Many simulations from one file: a model over a grid or a design, on all cores or a cluster, with one result."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl sweep`."""
    parser.add_argument("campaign", help="campaign file, or the name of a bundled one")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the results; an interrupted one goes on"
    )
    parser.add_argument(
        "--scheduler", metavar="tcp://HOST:PORT", help="a Dask cluster instead of this machine"
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes on this machine (default: its cores)"
    )
    parser.add_argument("--no-plot", action="store_true", help="draw no picture")


def run(args: argparse.Namespace) -> int:
    """The verb."""
    from rtctl.border.errors import InputError
    from rtctl.campaign.file import find_campaign
    from rtctl.campaign.local import cores
    from rtctl.campaign.plan import read_plan
    from rtctl.campaign.run import run_campaign
    from rtctl.cli.options import output_folder
    from rtctl.evaluation.metrics import finite
    from rtctl.output.interrupt import stop_on_interrupt
    from rtctl.output.progress import print_table, progress_bar
    from rtctl.plots.campaign import draw_campaign

    if args.workers is not None and args.workers < 1:
        raise InputError(f"--workers {args.workers}: at least 1 is needed")
    plan = read_plan(find_campaign(args.campaign))
    folder, quiet = output_folder(args.out), args.quiet or args.json
    title = plan.campaign.campaign.title
    with stop_on_interrupt() as stop, progress_bar(title, plan.design.samples, quiet=quiet) as advance:
        summary = run_campaign(
            plan, folder, workers=args.workers or cores(), scheduler=args.scheduler, stop=stop, advance=advance
        )  # fmt: skip
    if plan.campaign.picture is not None and not args.no_plot:
        draw_campaign(plan, folder)
    if args.json:
        print(json.dumps(finite(summary), indent=2))
    elif not args.quiet:
        rows = [[key, f"{count:,}"] for key, count in summary.get("kind", {}).items()]
        rows += [[f"least error: {key}", f"{value:.6g}"] for key, value in summary.get("least", {}).items()]
        rows.append(["all", f"{summary['trajectories']:,}"])
        parts = summary["parts"]
        print_table(f"{title} ({summary['wall_s']:.1f} s, {parts['computed']} of {parts['all']} parts computed, "
                    f"the rest found in {folder})", ["", "trajectories"], rows)  # fmt: skip
    return 0
