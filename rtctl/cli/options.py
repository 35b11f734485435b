"""What several verbs share: where results go, stopping on Ctrl-C between two exchanges."""

from __future__ import annotations

import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from rtctl.border.errors import InputError
from rtctl.output.progress import progress_bar


def output_folder(path: Path) -> Path:
    """`path`, of which all that exists is a folder to write in: known before anything moves. Raises InputError."""
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir():
        raise InputError(f"--out {path}: {existing} is a file, a folder is needed")
    try:
        with tempfile.TemporaryFile(
            dir=existing
        ):  # permission bits say nothing to root, nor of odd file systems
            pass
    except OSError as error:
        raise InputError(
            f"--out {path}: {existing} cannot be written to: {error.strerror or error}"
        ) from None
    return path


@contextmanager
def watched_run(title: str, steps: int, *, quiet: bool) -> Iterator[Callable[[], bool]]:
    """`stop_on_interrupt`, and a bar for a person who is watching: the loop asks once an exchange."""
    with stop_on_interrupt() as stop_requested, progress_bar(title, steps, quiet=quiet) as advance:
        done = 0

        def asked() -> bool:
            nonlocal done
            done += 1
            if done % 250 == 0:
                advance(done)
            return stop_requested()

        yield asked


@contextmanager
def stop_on_interrupt(cancel: Callable[[], None] = lambda: None) -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C, SIGTERM and SIGHUP ask for an end after the step under way, and call `cancel`.

    A second Ctrl-C or SIGTERM is immediate. A terminal that is closed sends SIGHUP, often twice; under `nohup` it stays
    ignored.
    """
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked and number != signal.SIGHUP:
            raise KeyboardInterrupt
        asked = True
        cancel()

    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, ask) for number in numbers}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
