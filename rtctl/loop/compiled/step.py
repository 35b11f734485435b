"""Observer, PI and limits as one compiled call: `ReadableStep` without the interpreter between its parts, to the bit.

For the VO2 actuator's observer under a PI, with or without feedforward. The parts' own kernels are compiled into one;
what they keep in Python between two steps lies in one array here,

    control = (integral, error, kp, ki, deadband, low, high, slew)

and goes back to the controller where a gain is changed. `ReadableStep` is the oracle: a test holds both to the same
bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.controllers.feedforward import InverseFeedforward, packed_inverse_step
from rtctl.controllers.pi import CommandTerms, Feedforward, NoFeedforward, PiController, PiState, pi_step
from rtctl.estimators.observer import ObserverEstimator, packed_observer_step
from rtctl.interfaces import Controller, Estimator
from rtctl.loop.step import Decision, Levels, ReadableStep, Step, preview_of
from rtctl.safety.limits import CommandLimits, limit_command

INTEGRAL, ERROR, KP, KI, DEADBAND, LOW, HIGH, SLEW = range(8)
Decided = tuple[float, float, float, float, float]


@kernel
def pi_within_limits(
    control: FloatArray,
    feedforward: float,
    value: float,
    setpoint: float,
    level: float,
    elapsed_s: float,
) -> Decided:
    """Take one step of the PI and limit its command; the integral gives up what the limits hold back.

    Args:
        control: integral, error, gains, deadband and limits, advanced in place.
        feedforward: the feedforward's command [mA]; 0: there is none.
        value: the estimate [um].
        setpoint: the setpoint of this sample [um].
        level: the level that was commanded last [mA].
        elapsed_s: time since the reading before [s].

    Returns:
        The next level, the level that was asked for, and its proportional, integral and feedforward terms [mA]. A level
        that is not finite is returned as it is.
    """
    error, proportional, integral = pi_step(
        control[INTEGRAL], setpoint - value, elapsed_s, control[KP], control[KI], control[DEADBAND]
    )
    asked = proportional + integral + feedforward
    control[ERROR], control[INTEGRAL] = error, integral
    if not math.isfinite(asked):
        return asked, asked, proportional, integral, feedforward
    allowed = limit_command(asked, level, control[SLEW] * elapsed_s, control[LOW], control[HIGH])
    if allowed != asked:
        control[INTEGRAL] = integral + (allowed - asked)
    return allowed, asked, proportional, integral, feedforward


# 9 parameters because a kernel takes its arrays one by one
@kernel
def observer_pi_step(  # noqa: PLR0913
    memory: FloatArray,
    control: FloatArray,
    forward: FloatArray,
    setpoint: float,
    upcoming: float,
    believed: float,
    level: float,
    sensed: float,
    elapsed_s: float,
) -> tuple[float, float, float, int, float, float, float, float, float]:
    """Take one step of the observer, then of the PI within its limits.

    Args:
        memory: the observer's memory, advanced in place.
        control: the controller's memory, likewise.
        forward: the feedforward's memory, likewise; empty: there is none.
        setpoint: the setpoint of this sample [um].
        upcoming: the setpoint that the next command aims at [um].
        believed: the level that was in force before the reading [mA].
        level: the level that was commanded last [mA].
        sensed: the reading [ohm].
        elapsed_s: time since the reading before [s].

    Returns:
        What `packed_observer_step` returns, then what `pi_within_limits` returns.
    """
    value, surrogate, error, status = packed_observer_step(memory, believed, sensed, elapsed_s)
    term = packed_inverse_step(forward, upcoming, elapsed_s) if forward.size > 0 else 0.0
    allowed, asked, proportional, integral, feedforward = pi_within_limits(
        control, term, value, setpoint, level, elapsed_s
    )
    return value, surrogate, error, status, allowed, asked, proportional, integral, feedforward


class CompiledStep:
    """A `Step` of an observer and a PI."""

    def __init__(
        self, estimator: ObserverEstimator, controller: PiController, limits: tuple[CommandLimits, ...]
    ) -> None:
        self.estimator, self.controller, self._limit = estimator, controller, limits[0]
        self._readable = ReadableStep(estimator, controller, limits)
        self.preview_s, self.reading_error = preview_of(controller), estimator.reading_error
        self._control = np.zeros(8)
        self._memory = self._forward = np.empty(0)
        self._decide: Callable[..., Any] = observer_pi_step

    def start(self, levels: Levels, setpoint: float, sensed: Sequence[float], period_s: float) -> Levels:
        """Start the parts and take over their state; see `Step`."""
        first = self._readable.start(levels, setpoint, sensed, period_s)
        self._memory = self.estimator.memory
        self._forward = _memory_of(self.controller.feedforward)
        self._take_over()
        return first

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
        value, surrogate, error, status, allowed, asked, *terms = self._decide(
            self._memory, self._control, self._forward, setpoint, upcoming, believed[0], levels[0], sensed[0],
            elapsed_s,
        )  # fmt: skip
        if not math.isfinite(asked):
            self._limit.clip(asked, levels[0], elapsed_s)  # raises, with the reason
        estimate = self.estimator.estimate_of(value, surrogate, error, status)
        return Decision(estimate, (allowed,), CommandTerms(*terms))

    def follow(
        self,
        setpoint: float,
        upcoming: float,
        believed: Levels,
        applied: Levels,
        sensed: Sequence[float],
        elapsed_s: float,
    ) -> None:
        """Follow by the parts, which share their memories with the compiled call; see `Step`."""
        self._readable.follow(setpoint, upcoming, believed, applied, sensed, elapsed_s)
        self._take_over()

    def model_reading(self) -> float:
        """See `Step`."""
        return self.estimator.model_reading()

    def kernel_arguments(self) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """Return the memories that `observer_pi_step` advances, and the standard error of the model's fit [um]."""
        return self._memory, self._control, self._forward, self.estimator.fit_error

    def parameters(self) -> Mapping[str, float]:
        """See `Step`."""
        return self.controller.parameters()

    def change(self, name: str, value: float) -> None:
        """Change a parameter in the controller and take it over; see `Step`."""
        self.controller.resume(PiState(float(self._control[INTEGRAL]), float(self._control[ERROR])))
        self._readable.change(name, value)
        self._take_over()

    def _take_over(self) -> None:
        controller, limit = self.controller, self._limit
        integral, error = controller.state()
        self._control[:] = (integral, error, controller.gains.kp, controller.gains.ki, controller.deadband,
                            limit.low, limit.high, limit.slew_per_s)  # fmt: skip


def _memory_of(feedforward: Feedforward) -> FloatArray:
    """Return the memory that a feedforward's kernel advances; empty if there is none."""
    return feedforward.memory if isinstance(feedforward, InverseFeedforward) else np.empty(0)


def compiled_step(
    estimator: Estimator, controller: Controller, limits: tuple[CommandLimits, ...]
) -> Step | None:
    """Return the parts as one compiled call; None if one of them is of another type, also of a derived one."""
    if type(estimator) is not ObserverEstimator or type(controller) is not PiController:
        return None
    known = type(controller.feedforward) in (NoFeedforward, InverseFeedforward)
    if not known or len(limits) != 1 or limits[0].stop:
        return None
    return CompiledStep(estimator, controller, limits)
