"""What happens to a run beside its rows: where it starts, what was changed, what went wrong; a line of JSON each.

Floats are written so that they read back to the bit.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.border.errors import InputError


class Event(NamedTuple):
    """One line. `step`: the index of the sample that it comes before."""

    step: int
    kind: str
    """start | change | fault | rearmed"""
    values: Mapping[str, Any]


class Events:
    """Keeps them, and hands each as a line to `write`, which must not wait."""

    def __init__(self, write: Callable[[bytes], object] = lambda line: None) -> None:
        self._write = write
        self.noted: list[Event] = []

    def note(self, step: int, kind: str, **values: Any) -> None:
        """It happened before sample `step`."""
        self.noted.append(Event(step, kind, values))
        written = {key: _written(value) for key, value in values.items()}
        self._write(json.dumps({"step": step, "event": kind, **written}).encode() + b"\n")


def append_to(path: Path, ask: Callable[[Callable[[], None]], object]) -> Callable[[bytes], object]:
    """A `write` for `Events` that appends to a new file at `path`, in the thread that `ask` asks."""
    path.unlink(missing_ok=True)

    def append(line: bytes) -> None:
        number = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(number, line)
        finally:
            os.close(number)

    return lambda line: ask(lambda: append(line))


def read_events(path: Path) -> Iterator[Event]:
    """Those of a file; a line that a kill has cut off ends them. Raises InputError where there is no file."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    for line in text.splitlines(keepends=True):
        if not line.endswith("\n"):
            return
        content = json.loads(line)
        values = {key: _read(value) for key, value in content.items() if key not in ("step", "event")}
        yield Event(content["step"], content["event"], values)


def _written(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return [_written(inner) for inner in value] if isinstance(value, tuple | list) else value


def _read(value: Any) -> Any:
    if value in ("nan", "inf", "-inf"):
        return float(value)
    return tuple(_read(inner) for inner in value) if isinstance(value, list) else value
