"""The last line of a verb: the command that comes next, where one is obvious."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from itertools import count
from pathlib import Path


def say_next(args: argparse.Namespace, words: Sequence[object], first: str = "") -> None:
    """Print `now run: rtctl ...` from the words after `rtctl`; nothing under --quiet and --json, or without words.

    Args:
        args: Options of the verb.
        words: The words after `rtctl`.
        first: What is to be done before; "": nothing.
    """
    if words and not (args.quiet or args.json):
        print(f"now {f'{first}, then ' if first else ''}run: {shlex.join(['rtctl', *map(str, words)])}")


def answer_folder(parent: Path, model: Path) -> Path:
    """Return a folder for the diagnosis of a model, named after it, that holds no earlier answer.

    Of model.toml it is `diagnosis`, of model2.toml `diagnosis2`, of beam.toml `diagnosis-beam`.
    """
    stem = model.stem
    name = "diagnosis" + (stem.removeprefix("model") if stem.startswith("model") else f"-{stem}")
    names = (name if k == 1 else f"{name}-{k}" for k in count(1))
    return next(parent / one for one in names if not (parent / one / "diagnosis.json").exists())
