"""One line that is renewed in place while something runs, cheap enough to stand beside a loop in real time.

In a pipe a line is printed now and then instead. It is written directly: rich renders for milliseconds while it holds
the interpreter's lock.
"""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Show = Callable[[float, str], None]
"""Takes the share that is done, 0 to 1, and what to say."""
EVERY_S = 10.0
"""Time between two lines in a pipe [s]."""
SOON_S = 2.0
"""Time after which the remaining time is told [s]: before, it is hardly known."""


@contextmanager
def live_line(title: str, *, quiet: bool) -> Iterator[Show]:
    """Show a line on standard error; its end is clean, whatever was shown last."""
    if quiet:
        yield lambda share, text: None
    elif sys.stderr.isatty():
        yield from _in_terminal()
    else:
        yield _in_pipe(title)


def _in_terminal() -> Iterator[Show]:
    begun_s, shown = time.monotonic(), False

    def show(share: float, text: str) -> None:
        nonlocal shown
        width = shutil.get_terminal_size().columns - 1
        line = f"{share:4.0%} {_remaining(time.monotonic() - begun_s, share)}{text}"
        sys.stderr.write(f"\r\x1b[K{line[:width]}")
        sys.stderr.flush()
        shown = True

    try:
        yield show
    finally:
        if shown:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def _in_pipe(title: str) -> Show:
    begun_s = last_s = time.monotonic()

    def show(share: float, text: str) -> None:
        nonlocal last_s
        now_s = time.monotonic()
        if now_s - last_s >= EVERY_S:
            last_s = now_s
            print(
                f"{title}: {share:.0%}, {_remaining(now_s - begun_s, share)}{text}",
                file=sys.stderr,
                flush=True,
            )

    return show


def _remaining(elapsed_s: float, share: float) -> str:
    """Return `0:12+0:30 `, elapsed and remaining time, once they are known."""
    if elapsed_s < SOON_S or not share > 0.0:
        return ""
    return f"{clock_text(elapsed_s)}+{clock_text(elapsed_s * (1.0 - share) / share)} "


def clock_text(seconds: float) -> str:
    """Return `1:02:03` or `2:03`."""
    whole = round(seconds)
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
