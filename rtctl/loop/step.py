"""One decision of the loop: reading to estimate to command within its limits; a replay calls the same.

`ReadableStep` calls the parts one after the other; `rtctl.loop.compiled.step` does the same in one compiled call,
to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.interfaces import Controller, Estimate, Estimator
from rtctl.safety.limits import CommandLimits

Levels = tuple[float, ...]


class Decision(NamedTuple):
    """The decision about one reading."""

    estimate: Estimate
    levels: Levels
    """The next level of each command, within its limits [its unit]."""
    terms: tuple[float, ...]
    """Terms of the controller's command, before the limits."""


class Step(Protocol):
    """A step of the loop: estimator, controller and limits with their memory."""

    preview_s: float
    """How far beyond the next sample the controller looks at the setpoint [s]."""
    reading_error: float
    """RMS error of the reading that the estimator's model expects, as a logarithm; infinite: it expects none."""

    @property
    def estimator(self) -> Estimator:
        """The estimator."""
        ...

    @property
    def controller(self) -> Controller:
        """The controller."""
        ...

    def model_reading(self) -> float:
        """Return the reading that the model expected in the last step, as a logarithm."""
        ...

    def start(self, levels: Levels, setpoint: float, sensed: Sequence[float], period_s: float) -> Levels:
        """Start at rest at the applied levels; return the first command, which continues from them.

        Args:
            levels: the applied level of each command [its unit].
            setpoint: the first setpoint [controlled unit].
            sensed: the last reading of each channel [its unit].
            period_s: sample period [s].
        """
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
        """Return the decision about one reading.

        Args:
            setpoint: the setpoint of this sample [controlled unit].
            upcoming: the setpoint that the next command aims at [controlled unit].
            believed: the levels that were in force before the reading [their units].
            levels: the levels that were commanded last [their units].
            sensed: the reading of each channel [its unit].
            elapsed_s: time since the reading before [s].
        """
        ...

    def follow(
        self,
        setpoint: float,
        upcoming: float,
        believed: Levels,
        applied: Levels,
        sensed: Sequence[float],
        elapsed_s: float,
    ) -> None:
        """Take note of a sample that another step decided; as `step`, but `applied` is what was commanded after it."""
        ...

    def parameters(self) -> Mapping[str, float]:
        """Return the parameters that can be changed while the loop runs, by name."""
        ...

    def change(self, name: str, value: float) -> None:
        """Change one of `parameters` without a bump of the command. Raise InputError, changing nothing, if invalid."""
        ...


class Adjustable(Protocol):
    """A controller with parameters that can be changed while it runs."""

    def parameters(self) -> Mapping[str, float]:
        """Return the parameters by name."""
        ...

    def change(self, name: str, value: float) -> None:
        """Change a parameter without a bump of the command. Raise ValueError on an invalid value."""
        ...


class ReadableStep:
    """A step that calls estimator, controller and limits one after the other."""

    def __init__(
        self, estimator: Estimator, controller: Controller, limits: tuple[CommandLimits, ...]
    ) -> None:
        self.estimator, self.controller, self._limits = estimator, controller, limits
        self.preview_s = preview_of(controller)
        self._model_reading: Callable[[], float] = getattr(estimator, "model_reading", lambda: math.nan)
        self.reading_error = float(getattr(estimator, "reading_error", math.inf))

    def model_reading(self) -> float:
        """See `Step`."""
        return self._model_reading()

    def start(self, levels: Levels, setpoint: float, sensed: Sequence[float], period_s: float) -> Levels:
        """See `Step`."""
        estimate = self.estimator.start(levels, sensed)
        self.controller.start(levels, setpoint, estimate)
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
        estimate = self.estimator.step(believed, sensed, elapsed_s)
        return self._command(setpoint, upcoming, estimate, levels, elapsed_s)

    def follow(
        self,
        setpoint: float,
        upcoming: float,
        believed: Levels,
        applied: Levels,
        sensed: Sequence[float],
        elapsed_s: float,
    ) -> None:
        """See `Step`."""
        estimate = self.estimator.step(believed, sensed, elapsed_s)
        self.controller.step(setpoint, upcoming, estimate, elapsed_s)
        self.controller.applied(applied)

    def parameters(self) -> Mapping[str, float]:
        """See `Step`."""
        return parameters_of(self.controller)

    def change(self, name: str, value: float) -> None:
        """See `Step`."""
        change_of(self.controller, name, value)

    def _command(
        self, setpoint: float, upcoming: float, estimate: Estimate, levels: Levels, elapsed_s: float
    ) -> Decision:
        """Control, limit, and tell the controller which levels are applied. Raise DriverError on a NaN."""
        action = self.controller.step(setpoint, upcoming, estimate, elapsed_s)
        asked = action.levels
        if len(asked) == 1:
            allowed: Levels = (self._limits[0].clip(asked[0], levels[0], elapsed_s),)
        else:
            allowed = tuple(
                limit.clip(level, old, elapsed_s)
                for limit, level, old in zip(self._limits, asked, levels, strict=True)
            )
        self.controller.applied(allowed)
        return Decision(estimate, allowed, action.terms)


def preview_of(controller: Controller) -> float:
    """Return how far beyond the next sample a controller looks at the setpoint [s]; 0 for most."""
    return float(getattr(controller, "preview_s", 0.0))


def upcoming_setpoints(setpoints: FloatArray, period_s: float, preview_s: float) -> FloatArray:
    """Return the setpoint (n,) one period and `preview_s` [s] after each sample; after the last one it stays."""
    following = np.append(setpoints[1:], setpoints[-1])
    if preview_s == 0.0:
        return following
    at = np.arange(len(setpoints), dtype=np.float64)
    upcoming: FloatArray = np.interp(np.minimum(at + 1.0 + preview_s / period_s, at[-1]), at, setpoints)
    return upcoming


def parameters_of(controller: Controller | Adjustable) -> Mapping[str, float]:
    """Return a controller's parameters by name; empty if it has none."""
    return controller.parameters() if hasattr(controller, "parameters") else {}


def change_of(controller: Controller | Adjustable, name: str, value: float) -> None:
    """Change a parameter of a controller. Raise InputError if it has none of this name, or on an invalid value."""
    known = parameters_of(controller)
    if name not in known or not hasattr(controller, "change"):
        raise InputError(
            f'"{name}" cannot be changed while the loop runs{nearest(name, ["setpoint", *known])}'
        )
    try:
        controller.change(name, value)
    except ValueError as error:
        raise InputError(f"{name} = {value:g}: {error}") from None
