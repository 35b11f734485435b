"""One decision of the loop: reading to estimate to command within its limits. Replaying a recording calls the same.

`ReadableStep` calls the parts one after the other; `rtctl.loop.compiled.step` does the same in one compiled call,
to the bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.interfaces import Controller, Estimate, Estimator
from rtctl.safety.limits import CommandLimits

Levels = tuple[float, ...]


class Decision(NamedTuple):
    """What came of one reading."""

    estimate: Estimate
    levels: Levels
    """To be commanded next, within the limits."""
    terms: tuple[float, ...]
    """Of the controller, before the limits."""


class Step(Protocol):
    """Estimator, controller and limits with their memory."""

    preview_s: float
    """How far beyond the next sample the controller looks at the set-point."""

    def start(self, levels: Levels, setpoint: float, sensed: Sequence[float], period_s: float) -> Levels:
        """At rest at the applied `levels`; the first command, which continues from them."""
        ...

    def step(
        self,
        setpoint: float,
        upcoming: float,
        believed: Levels,
        levels: Levels,
        sensed: Sequence[float],
        elapsed_s: float,
    ) -> Decision:
        """One sample: `sensed` was measured after `elapsed_s` of `believed`; `levels` were commanded last."""
        ...

    def parameters(self) -> Mapping[str, float]:
        """What of the controller can be changed while it runs, by name."""
        ...

    def change(self, name: str, value: float) -> None:
        """Change one of `parameters` without a bump of the command. Raises InputError, and then changes nothing."""
        ...


class Adjustable(Protocol):
    """A controller with parameters that can be changed while it runs."""

    def parameters(self) -> Mapping[str, float]:
        """By name."""
        ...

    def change(self, name: str, value: float) -> None:
        """Without a bump of the command. Raises ValueError on a value that it cannot have."""
        ...


class ReadableStep:
    """The parts one after the other."""

    def __init__(
        self, estimator: Estimator, controller: Controller, limits: tuple[CommandLimits, ...]
    ) -> None:
        self._estimator, self._controller, self._limits = estimator, controller, limits
        self.preview_s = preview_of(controller)

    def start(self, levels: Levels, setpoint: float, sensed: Sequence[float], period_s: float) -> Levels:
        """See `Step`."""
        estimate = self._estimator.start(levels, sensed)
        self._controller.start(levels, setpoint, estimate)
        return self._command(setpoint, setpoint, estimate, levels, period_s).levels

    def step(
        self,
        setpoint: float,
        upcoming: float,
        believed: Levels,
        levels: Levels,
        sensed: Sequence[float],
        elapsed_s: float,
    ) -> Decision:
        """See `Step`."""
        estimate = self._estimator.step(believed, sensed, elapsed_s)
        return self._command(setpoint, upcoming, estimate, levels, elapsed_s)

    def parameters(self) -> Mapping[str, float]:
        """See `Step`."""
        return parameters_of(self._controller)

    def change(self, name: str, value: float) -> None:
        """See `Step`."""
        change_of(self._controller, name, value)

    def _command(
        self, setpoint: float, upcoming: float, estimate: Estimate, levels: Levels, elapsed_s: float
    ) -> Decision:
        """Control, then limit; the controller learns what was let through. Raises DriverError on a NaN."""
        action = self._controller.step(setpoint, upcoming, estimate, elapsed_s)
        asked = action.levels
        if len(asked) == 1:
            allowed: Levels = (self._limits[0].clip(asked[0], levels[0], elapsed_s),)
        else:
            allowed = tuple(
                limit.clip(level, old, elapsed_s)
                for limit, level, old in zip(self._limits, asked, levels, strict=True)
            )
        self._controller.applied(allowed)
        return Decision(estimate, allowed, action.terms)


def preview_of(controller: Controller) -> float:
    """How far beyond the next sample it looks at the set-point [s]; most do not."""
    return float(getattr(controller, "preview_s", 0.0))


def upcoming_setpoints(setpoints: FloatArray, period_s: float, preview_s: float) -> FloatArray:
    """The set-point one period and `preview_s` after each sample; after the last one it stays."""
    following = np.append(setpoints[1:], setpoints[-1])
    if preview_s == 0.0:
        return following
    at = np.arange(len(setpoints), dtype=np.float64)
    found: FloatArray = np.interp(np.minimum(at + 1.0 + preview_s / period_s, at[-1]), at, setpoints)
    return found


def parameters_of(controller: Controller | Adjustable) -> Mapping[str, float]:
    """Those of a controller that has any."""
    return controller.parameters() if hasattr(controller, "parameters") else {}


def change_of(controller: Controller | Adjustable, name: str, value: float) -> None:
    """Change one of them. Raises InputError."""
    known = parameters_of(controller)
    if name not in known or not hasattr(controller, "change"):
        raise InputError(
            f'"{name}" cannot be changed while the loop runs{nearest(name, ["setpoint", *known])}'
        )
    try:
        controller.change(name, value)
    except ValueError as error:
        raise InputError(f"{name} = {value:g}: {error}") from None
