"""A script by which a shell completes verbs, options and files: eval "$(rtctl completion bash)"."""

from __future__ import annotations

import argparse

from rtctl.cli.completion import SHELLS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl completion`."""
    parser.add_argument("shell", choices=SHELLS, help="which shell")


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    from rtctl.cli import build_parser
    from rtctl.cli.completion import completion_script
    from rtctl.cli.options import print_json

    verbs = next(one for one in build_parser()._actions if isinstance(one, argparse._SubParsersAction))
    script = completion_script(args.shell, verbs.choices)
    if args.json:
        print_json({"shell": args.shell, "script": script})
    elif not args.quiet:
        print(script, end="")
    return 0
