"""The channel by which a running loop is changed: a setpoint or a gain.

A socket in the run's folder, or a test, offers a change; the loop takes it between two exchanges, applies it without a
bump and notes it among the run's events, so that a replay makes the same change at the same sample.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.mechanisms import without_brackets
from rtctl.border.records import DeviceProfile
from rtctl.loop.successor import Successor

SETPOINT = "setpoint"
STOP = "stop"
"""The change that ends the run at the safe levels."""
MODEL = "model"
"""The change to estimator and tuning of another model of the run; its value is that model's number, 0 the first."""


class Change(NamedTuple):
    """A parameter and its new value [unit of the run]; a setpoint of NaN is that of the plan again."""

    name: str
    value: float


def units_of_parameters(profile: DeviceProfile, *, is_played: bool) -> dict[str, str]:
    """Return the unit of each parameter that a run with devices of `profile` can change.

    Where an excitation is played there is no controller, and the set-point is the level of the first command.
    """
    output, command = profile.reference.unit, profile.commands[0].unit
    if is_played:
        return {SETPOINT: command}
    return {
        SETPOINT: output,
        "controller.kp": without_brackets(f"({command})/({output})"),
        "controller.ki": without_brackets(f"({command})/(({output})*s)"),
        "controller.kd": without_brackets(f"({command})*s/({output})"),
    }


def _no_model(number: int) -> tuple[Successor, str]:
    raise InputError("the run has not begun yet, or has no model that could be changed")


class ParameterChannel:
    """A queue of changes from any thread to the loop's; nothing here waits."""

    def __init__(self) -> None:
        self._offered: deque[Change] = deque()
        self.stopped = False
        """Whether the run was asked to end; for the places where no change is taken."""
        self.attention = np.zeros(1, dtype=np.int64)
        """Not 0 if a change is waiting: for a compiled block."""
        self.judge: Callable[[str, float], str] = lambda name, value: ""
        """Says what to know of a change before it is offered; raises InputError on one that must not be made."""
        self.parameters: Callable[[], Mapping[str, float]] = dict
        """Returns the controller's parameters with the changes that were taken."""
        self.prepare: Callable[[int], tuple[Successor, str]] = _no_model
        """Returns what is to take over with the model of a number, and what to know of it; raises InputError."""
        self.successor: Successor | None = None
        """What takes over with the next change of the model."""
        self.refuse: Callable[[Change], None] = lambda change: None
        """Called in the loop's thread with a change that the loop could not apply."""

    def offer(self, name: str, value: float) -> str:
        """Ask for a change at the next sample; return what to know of it.

        Raises:
            InputError: a gain is not finite, or the change must not be made.
        """
        if name != SETPOINT and not math.isfinite(value):
            raise InputError(f"{name} = {value}: a finite number is needed")
        remark = self.judge(name, value)
        self._offered.append(Change(name, value))
        self.attention[0] = 1
        return remark

    def offer_model(self, number: int) -> str:
        """Prepare another model, which may take seconds, and let it take over; return what to know of it.

        Raises:
            InputError: there is no such model, or it cannot be controlled within the margins.
        """
        self.successor, remark = self.prepare(number)
        self._offered.append(Change(MODEL, float(number)))
        self.attention[0] = 1
        return remark

    def stop(self) -> None:
        """Ask the run to end at its safe levels, before any other change that is waiting."""
        self.stopped = True
        self._offered.appendleft(Change(STOP, math.nan))
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
