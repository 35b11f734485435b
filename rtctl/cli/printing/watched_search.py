"""Progress of a diagnosis: a bar that names the fit under way, or one line a fit in a log; Ctrl-C cancels it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rtctl.cli.options import stop_on_interrupt
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.output.progress import say


@contextmanager
def watched_search(
    title: str, cancellation: CancellationToken, *, quiet: bool
) -> Iterator[Callable[[str], None]]:
    """Yield `report(text)` for `diagnose`; Ctrl-C or SIGTERM cancels, a second Ctrl-C interrupts at once."""
    with stop_on_interrupt(cancellation.cancel), _shown(title, quiet=quiet) as show:
        yield lambda text: show("stopping: writing what is done" if cancellation.cancelled else text)


@contextmanager
def _shown(title: str, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    if quiet:
        yield lambda text: None
        return
    if not sys.stderr.isatty():
        last = ""

        def line(text: str) -> None:
            nonlocal last
            if text != last:  # a mechanism is fitted from several starts
                say(f"  {text}", quiet=False)
            last = text

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn(),
        TextColumn("{task.completed} fits, now {task.fields[now]}", markup=False),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        # no total: how many fits there will be depends on what the first ones find
        task = bar.add_task(title.replace("[", r"\["), total=None, now="")
        yield lambda text: bar.update(task, advance=1, now=text)
