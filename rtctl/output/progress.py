"""Progress and tables for a person who is watching; silent otherwise. rich is imported when it is needed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

Advance = Callable[[int], None]
PIPE_WIDTH = 140
"""Columns of a table where no terminal says how wide it is."""


@contextmanager
def progress_bar(title: str, total: int, *, quiet: bool, forced: bool = False) -> Iterator[Advance]:
    """Show a bar on standard error if that is a terminal or `forced`; the callable takes how much is done."""
    if quiet or not (forced or sys.stderr.isatty()):
        yield lambda done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True, force_terminal=True if forced else None)
    with Progress(*columns, console=console, transient=not forced) as bar:
        task = bar.add_task(_plain(title), total=total)
        yield lambda done: bar.update(task, completed=done)


def say(text: str, *, quiet: bool) -> None:
    """One line of what is going on, on standard error."""
    if not quiet:
        print(text, file=sys.stderr, flush=True)


def print_table(title: str, headers: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table to standard output; numbers right-aligned, first column left."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=_plain(title), title_justify="left")
    for index, header in enumerate(headers):
        table.add_column(_plain(header), justify="left" if index == 0 else "right", no_wrap=index == 0)
    for row in rows:
        table.add_row(*(_plain(cell) for cell in row))
    Console(width=None if sys.stdout.isatty() else PIPE_WIDTH).print(table)


def _plain(text: str) -> str:
    """Units in brackets are text, not rich's markup."""
    from rich.markup import escape

    return escape(text)
