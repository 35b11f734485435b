"""The one channel by which a running loop is changed: a set-point or a gain, taken at the beginning of a step.

Whoever asks (a socket in the run's folder, a test) offers; the loop takes what is there between two exchanges, applies
it without a bump and notes it among the run's events, so that a replay makes the same change at the same step.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError

SETPOINT = "setpoint"


class Change(NamedTuple):
    """A parameter and its new value; a set-point that is no number goes back to the plan."""

    name: str
    value: float


class ParameterChannel:
    """From any thread to the loop's; nothing here waits."""

    def __init__(self) -> None:
        self._offered: deque[Change] = deque()
        self.attention = np.zeros(1, dtype=np.int64)
        """Not 0 where something is waiting: for a compiled block of steps."""
        self.refused: deque[tuple[Change, str]] = deque(maxlen=100)
        """What the loop could not apply, and why."""

    def offer(self, name: str, value: float) -> None:
        """Ask for a change at the next step. Raises InputError on a gain that is no number."""
        if name != SETPOINT and not math.isfinite(value):
            raise InputError(f"{name} = {value}: a finite number is needed")
        self._offered.append(Change(name, value))
        self.attention[0] = 1

    def __bool__(self) -> bool:
        return bool(self._offered)

    def take(self) -> Change:
        """The oldest one that is waiting."""
        self.attention[0] = 0  # first: an offer that comes meanwhile sets it again
        change = self._offered.popleft()
        if self._offered:
            self.attention[0] = 1
        return change
