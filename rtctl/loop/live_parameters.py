"""The channel by which a running loop is changed: a setpoint or a gain.

A socket in the run's folder, or a test, offers a change; the loop takes it between two exchanges, applies it without a
bump and notes it among the run's events, so that a replay makes the same change at the same sample.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError

SETPOINT = "setpoint"


class Change(NamedTuple):
    """A parameter and its new value [unit of the run]; a setpoint of NaN is that of the plan again."""

    name: str
    value: float


class ParameterChannel:
    """A queue of changes from any thread to the loop's; nothing here waits."""

    def __init__(self) -> None:
        self._offered: deque[Change] = deque()
        self.attention = np.zeros(1, dtype=np.int64)
        """Not 0 if a change is waiting: for a compiled block."""
        self.refused: deque[tuple[Change, str]] = deque(maxlen=100)
        """Changes that the loop could not apply, and why."""

    def offer(self, name: str, value: float) -> None:
        """Ask for a change at the next sample. Raise InputError on a gain that is not finite."""
        if name != SETPOINT and not math.isfinite(value):
            raise InputError(f"{name} = {value}: a finite number is needed")
        self._offered.append(Change(name, value))
        self.attention[0] = 1

    def __bool__(self) -> bool:
        return bool(self._offered)

    def take(self) -> Change:
        """Return the oldest change that is waiting, and remove it."""
        self.attention[0] = 0  # first: an offer that comes meanwhile sets it again
        change = self._offered.popleft()
        if self._offered:
            self.attention[0] = 1
        return change
