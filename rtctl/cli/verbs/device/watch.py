"""A page that shows a run while it lasts and afterwards, in a browser; also changes it, or feeds other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

NICENESS = 5
"""The page gives way to the loop where they share a processor."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl watch`."""
    watched = parser.add_mutually_exclusive_group(required=True)
    watched.add_argument(
        "run",
        nargs="?",
        type=Path,
        help="folder of a run (its --out), of several (rtctl demo), or of a dataset",
    )
    watched.add_argument(
        "--live",
        metavar="ADDRESS",
        help="a run under way: its folder or the control.sock in it; or a page served elsewhere: http://HOST:PORT/TOKEN/",
    )
    parser.add_argument(
        "--port", type=int, help="port of the page; 0: any free one (default: 8787, or a free one)"
    )
    parser.add_argument(
        "--control",
        action="store_true",
        help="let the page (and EPICS clients) change set-point and gains; the page also stops the run",
    )
    parser.add_argument(
        "--plotjuggler",
        metavar="HOST:PORT",
        help="also send the rows there as UDP packets of JSON (usual port: 9870)",
    )
    parser.add_argument(
        "--mcap",
        type=Path,
        metavar="FILE.mcap",
        help="also write a file that grows with the run and is whole at any moment",
    )
    parser.add_argument(
        "--epics",
        metavar="PREFIX",
        help="also serve the run as EPICS process variables, such as PREFIXsetpoint",
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb: serve until Ctrl-C or SIGTERM."""
    import os

    from rtctl.api.runs.recordings import watch
    from rtctl.live_page.watching import first_words
    from rtctl.output.progress import say

    def ready(address: str) -> None:
        os.nice(NICENESS)
        if args.json:
            import json

            print(json.dumps({"address": address}), flush=True)
            return
        print(address, flush=True)
        only = "" if args.control else " (it only shows; --control lets it change the run)"
        if args.run is not None and (words := first_words(args.run)):
            say(words, quiet=args.quiet)
        say(f"open it in a browser of this machine{only}; Ctrl-C ends it", quiet=args.quiet)

    watch(
        args.run,
        live=args.live,
        port=args.port,
        control=args.control,
        plotjuggler=args.plotjuggler,
        mcap=args.mcap,
        epics=args.epics,
        ready=ready,
    )
    return 0
