"""One way to do a task."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Tool(NamedTuple):
    """One way to do a task: `run` does it and is timed, `judge` says how well from what it returned."""

    name: str
    run: Callable[[], Any]
    judge: Callable[[Any], str]
    once: bool = False
    """Whether it is run only once, as it takes long."""
