"""Events of a run beside its rows: starts, changes of parameters, faults; a line of JSON each.

Floats are written so that they read back to the bit.
"""

from __future__ import annotations

import json
import math
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.border.errors import InputError

START = "start"
LONGEST_WAIT_S = 0.2
"""Time for which the start of a run waits for a disk."""


class Event(NamedTuple):
    """One event."""

    step: int
    """Index of the sample that it comes before."""
    kind: str
    """start | change | model | refused | fault | rearmed; beside the loop: doubt | injected"""
    values: Mapping[str, Any]
    """Further values by name."""


class Events:
    """A list of events; each is also handed as a line to `write`, which must not wait, but for the start of a run.

    Rows are on the disk as soon as they are recorded, and say nothing without where they started.
    """

    def __init__(self, write: Callable[[bytes, bool], object] = lambda line, wait: None) -> None:
        self._write = write
        self.noted: list[Event] = []

    def note(self, step: int, kind: str, **values: Any) -> None:
        """Note an event before sample `step`."""
        self.noted.append(Event(step, kind, values))
        encoded = {key: _encode(value) for key, value in values.items()}
        self._write(json.dumps({"step": step, "event": kind, **encoded}).encode() + b"\n", kind == START)


def append_to(path: Path, ask: Callable[[Callable[[], None]], object]) -> Callable[[bytes, bool], None]:
    """Return a `write` for `Events` that appends to a new file at `path`, in the thread that `ask` hands it to.

    Asked to wait, it does until the line is written, `LONGEST_WAIT_S` at most.
    """
    path.unlink(missing_ok=True)

    def append(line: bytes) -> None:
        number = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(number, line)
        finally:
            os.close(number)

    def write(line: bytes, wait: bool) -> None:
        written = threading.Event()

        def work() -> None:
            append(line)
            written.set()

        ask(work)
        if wait:
            written.wait(LONGEST_WAIT_S)

    return write


def read_events(path: Path) -> Iterator[Event]:
    """Yield the events of a file, up to a line that was cut off. Raise InputError if there is no file."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    for line in text.splitlines(keepends=True):
        if not line.endswith("\n"):
            return
        content = json.loads(line)
        values = {key: _decode(value) for key, value in content.items() if key not in ("step", "event")}
        yield Event(content["step"], content["event"], values)


def _encode(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return [_encode(inner) for inner in value] if isinstance(value, tuple | list) else value


def _decode(value: Any) -> Any:
    if value in ("nan", "inf", "-inf"):
        return float(value)
    return tuple(_decode(inner) for inner in value) if isinstance(value, list) else value
