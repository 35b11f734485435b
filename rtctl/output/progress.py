"""Progress and messages for a person who watches a terminal or a notebook; silent otherwise.

rich and IPython are imported when they are needed.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Any

from rtctl.border.errors import InputError
from rtctl.output.fit_lines import FitLines, Lasting, Share, Stage, reminded, work_texts
from rtctl.output.live_line import Show, live_line
from rtctl.output.tables import plain

Advance = Callable[[int], None]
Listener = Callable[[str, float | None], None]
Progress = bool | Listener
"""True: bars and messages; False: silence; a callable: hears each message, and the share that is done or None."""


@dataclass(frozen=True, slots=True)
class Reporter:
    """The way in which a long task reports what it does."""

    quiet: bool
    listener: Listener | None = None

    def say(self, text: str) -> None:
        """Report one line: on standard error, or to the listener."""
        if self.listener is not None:
            self.listener(text, None)
        else:
            say(text, quiet=self.quiet)

    @contextmanager
    def bar(self, title: str, total: int) -> Iterator[Advance]:
        """Show how much of `total` is done; the callable takes the amount."""
        if self.listener is None:
            with progress_bar(title, total, quiet=self.quiet) as advance:
                yield advance
            return
        hear = self.listener
        yield lambda done: hear(title, min(1.0, done / max(total, 1)))

    @contextmanager
    def live(self, title: str) -> Iterator[Show]:
        """Show how something goes that says so itself: a line renewed in place, a line now and then in a log."""
        if self.listener is not None:
            hear = self.listener
            yield lambda share, text: hear(f"{title}: {text}", min(1.0, share))
        elif not self.quiet and in_notebook():
            with _notebook_line() as show:
                yield lambda share, text: show(f"{title}: {text}", share)
        else:
            with live_line(title, quiet=self.quiet) as show_line:
                yield show_line

    @contextmanager
    def fits(
        self, title: str, share: Share = lambda: None, stage_of: Stage = lambda text: text
    ) -> Iterator[Callable[[str], None]]:
        """Show the fit under way, whose number is not known before: a bar, or a line now and then in a log."""
        if self.listener is None:
            with _fits(title, share, stage_of, quiet=self.quiet) as show:
                yield show
            return
        hear = self.listener
        yield lambda text: hear(text, None)


def reporter(progress: Progress) -> Reporter:
    """Return the reporter of an option `progress`. Raises InputError where it is neither a truth value nor callable."""
    if isinstance(progress, bool):
        return Reporter(quiet=not progress)
    if not callable(progress):
        raise InputError(f"progress must be True, False or a callable (text, share), got {progress!r}")
    return Reporter(quiet=False, listener=progress)


@contextmanager
def progress_bar(title: str, total: int, *, quiet: bool, forced: bool = False) -> Iterator[Advance]:
    """Show a bar in a notebook, or on standard error if that is a terminal or `forced`.

    The callable takes how much of `total` is done.
    """
    if quiet:
        yield lambda done: None
    elif in_notebook():
        with _notebook_line() as show:
            yield lambda done: show(title, done / max(total, 1))
    elif not (forced or sys.stderr.isatty()):
        yield lambda done: None
    else:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
        from rich.progress import Progress as Bars

        columns = (
            TextColumn("{task.description}"), BarColumn(bar_width=20), TaskProgressColumn(), TimeElapsedColumn(),
            TextColumn("and"), TimeRemainingColumn(), TextColumn("left"),
        )  # fmt: skip
        console = Console(stderr=True, force_terminal=True if forced else None)
        with Bars(*columns, console=console, transient=not forced) as bar:
            task = bar.add_task(plain(title), total=total)
            yield lambda done: bar.update(task, completed=done)


@contextmanager
def _fits(title: str, share: Share, stage_of: Stage, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    if quiet:
        yield lambda text: None
    elif in_notebook():
        with _notebook_line() as show:
            yield lambda text: show(f"{title}: {text}", None)
    elif not sys.stderr.isatty():
        lines = FitLines(title, share, stage_of, partial(say, quiet=False))
        with reminded(lines):
            yield lines.show
    else:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bars

        columns = (
            TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn(),
            TextColumn("{task.completed} fits{task.fields[work]}, now {task.fields[now]}", markup=False),
        )  # fmt: skip
        with Bars(*columns, console=Console(stderr=True), transient=True) as bar:
            # no total: how many fits there will be depends on what the first ones find
            task = bar.add_task(title.replace("[", r"\["), total=None, now="", work="")

            def update(text: str) -> None:
                if isinstance(text, Lasting):
                    bar.console.print(f"{title}: {text}", markup=False, highlight=False)
                    return
                texts = work_texts(0.0, share())
                bar.update(task, advance=1, now=text, work=f", {texts[0]}" if texts else "")

            yield update


def in_notebook() -> bool:
    """Return whether a notebook's kernel runs this process; imports nothing where it does not."""
    if "ipykernel" not in sys.modules:
        return False
    shell = importlib.import_module("IPython").get_ipython()
    return shell is not None and type(shell).__name__ == "ZMQInteractiveShell"


@contextmanager
def _notebook_line() -> Iterator[Callable[[str, float | None], None]]:
    """Show one line below a cell, renewed in place (needs no widgets) and cleared at the end."""
    html: Any = importlib.import_module("IPython.display").HTML
    handle: Any = importlib.import_module("IPython.display").display(html(""), display_id=True)

    def show(text: str, share: float | None) -> None:
        value = "" if share is None else f' value="{min(1.0, share):.3f}"'
        handle.update(html(f"<progress{value}></progress> {escape(text)}"))

    try:
        yield show
    finally:
        handle.update(html(""))


def say(text: str, *, quiet: bool) -> None:
    """Print one line of what is going on, on standard error."""
    if not quiet:
        print(text, file=sys.stderr, flush=True)
