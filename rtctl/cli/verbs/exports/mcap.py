"""`rtctl export mcap RUN --out FILE`: rows, times, changes and events of a run."""

from __future__ import annotations

import argparse


def run(args: argparse.Namespace) -> int:
    """Write the file."""
    from rtctl.api.runs.recordings import export_mcap
    from rtctl.border.errors import InputError
    from rtctl.cli.options import output_file, print_json
    from rtctl.output.progress import say

    if args.source is None:
        raise InputError("mcap: the folder of a run is needed: rtctl export mcap RUN --out FILE")
    rows = export_mcap(args.source, output_file(args.out, "an MCAP file", "export mcap"))
    if args.json:
        print_json({"file": str(args.out), "rows": rows})
    else:
        say(f"{args.out}: {rows} rows", quiet=args.quiet)
    return 0
