"""The last line of a verb: the command that comes next, where one is obvious."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence


def say_next(args: argparse.Namespace, words: Sequence[object], first: str = "") -> None:
    """Print `now run: rtctl ...` from the words after `rtctl`; nothing under --quiet and --json, or without words.

    Args:
        args: Options of the verb.
        words: The words after `rtctl`.
        first: What is to be done before; "": nothing.
    """
    if words and not (args.quiet or args.json):
        print(f"now {f'{first}, then ' if first else ''}run: {shlex.join(['rtctl', *map(str, words)])}")
