"""One sample of the exported loop: judge the reading, estimate, control within the limits, account for the energy.

The order is that of `rtctl.loop.sampler` and `rtctl.loop.compiled.block`, whose kernels are called: a reading of an
exchange is judged by itself, then against the ones before it; the first ones settle the device at its safe level, and
the last of these starts estimator and controller without a bump. A fault is kept: the level is the safe one from then
on, until the state is initialised again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from rtctl.controllers.pi import beyond_deadband
from rtctl.controllers.pid import pid_applied, pid_start, pid_step
from rtctl.loop.compiled.block import is_accepted, is_affordable
from rtctl.loop.compiled.step import DEADBAND, ERROR, INTEGRAL, KP, pi_within_limits
from rtctl.safety.guards import changes_too_fast
from rtctl.safety.limits import limit_command
from rtctl.safety.plausibility import UINT32, is_plausible

IMPLAUSIBLE, TOO_FAST, UNLIKELY, NOT_A_LEVEL, TOO_MUCH_ENERGY = range(1, 6)
"""Faults: a reading out of range, not new or of a device with a fault; one that changes too fast; one that does not
follow on those before it; a command that is not finite; one that exceeds the limit of the mean square."""

Record = Any
"""A record inside a function; numba knows its type, mypy does not."""


class LoopControl(NamedTuple):
    """The functions of a controller."""

    set_zero: Callable[..., Any]
    """(output): sets its terms to zero."""
    start: Callable[..., Any]
    """(state, constants, value, setpoint): continues from the level in force without a bump."""
    step: Callable[..., Any]
    """(state, output, constants, value, setpoint, upcoming, elapsed) -> level within its limits, level asked for."""


def pi_control(forward: Callable[..., Any] | None) -> LoopControl:
    """Return a PI with a feedforward (state, constants, upcoming, elapsed) -> command; None: there is none."""
    has_feedforward = forward is not None
    feedforward: Any = forward

    def set_zero(o: Record) -> None:
        """Set the terms to zero."""
        o.proportional = o.integral = o.feedforward = 0.0

    def start_pi(s: Record, c: Record, value: float, setpoint: float) -> None:
        """Start so that the first command continues from the level in force."""
        assumed = s.level if has_feedforward else 0.0
        s.control[ERROR] = beyond_deadband(setpoint - value, s.control[DEADBAND])
        s.control[INTEGRAL] = s.level - assumed - s.control[KP] * s.control[ERROR]

    # 7 parameters: those of every controller
    def step_pi(
        s: Record, o: Record, c: Record, value: float, setpoint: float, upcoming: float, elapsed_s: float
    ) -> tuple[float, float]:
        """Return the next level within its limits, and the one that is asked for."""
        term = feedforward(s, c, upcoming, elapsed_s) if has_feedforward else 0.0
        allowed, asked, o.proportional, o.integral, o.feedforward = pi_within_limits(
            s.control, term, value, setpoint, s.level, elapsed_s
        )
        return allowed, asked

    return LoopControl(set_zero, start_pi, step_pi)


def pid_control() -> LoopControl:
    """Return a PID."""

    def set_zero(o: Record) -> None:
        """Set the terms to zero."""
        o.proportional = o.integral = o.derivative = 0.0

    def start_pid(s: Record, c: Record, value: float, setpoint: float) -> None:
        """Start so that the first command continues from the level in force."""
        pid_start(s, c.pid, s.level, setpoint, value)

    def step_pid(
        s: Record, o: Record, c: Record, value: float, setpoint: float, upcoming: float, elapsed_s: float
    ) -> tuple[float, float]:
        """Return the next level within its limits, and the one that is asked for."""
        o.proportional = pid_step(s, c.pid, setpoint, value, elapsed_s)
        o.integral, o.derivative = s.integral, s.derivative
        allowed = limit_command(
            s.asked, s.level, c.limits.slew_per_s * elapsed_s, c.limits.low, c.limits.high
        )
        pid_applied(s, allowed)
        return allowed, s.asked

    return LoopControl(set_zero, start_pid, step_pid)


def counted(s: Record, i: Record) -> int:
    """Return how far the sample counter advanced; the first reading is new."""
    counts: int = (i.counter - s.counter) & UINT32
    return 1 if s.known == 0 else counts


# long because it is the text of all exported functions that join the parts, which share what is chosen here
def sample_of(  # noqa: C901
    estimate: Callable[..., Any], control: LoopControl, delay: int, *, swings: bool = False
) -> Callable[..., Any]:
    """Return the function of one sample.

    Args:
        estimate: estimator (state, constants, level, reading, elapsed) -> value, surrogate, standard error, status.
        control: the controller.
        delay: age of the command in force when a reading was taken, in commands.
        swings: whether the controller is shown the estimate without `state.swing`.
    """
    oldest, (set_zero, start_control, step_control) = delay, control

    def refusal(state: Record, i: Record) -> int:
        """Return why a reading is refused."""
        s = state[0]
        if not is_plausible(i.sensed, s.sensed_low, s.sensed_high, i.status, counted(s, i)):
            return IMPLAUSIBLE
        return TOO_FAST if changes_too_fast(i.sensed, s.sensed, s.rate, s.elapsed_s) else UNLIKELY

    def accepts(state: Record, i: Record) -> bool:
        """Return whether a reading is plausible and follows on those before it."""
        s = state[0]
        s.begun_ns, s.answered_ns = i.begun_ns, i.answered_ns
        if s.known == 0:  # the first one, with nothing before it
            return is_plausible(i.sensed, s.sensed_low, s.sensed_high, i.status, counted(s, i))
        return is_accepted(state, i.sensed, i.counter, i.time_us, i.status, s.elapsed_s)

    def command(
        s: Record, o: Record, c: Record, value: float, setpoint: float, upcoming: float, elapsed_s: float
    ) -> int:
        """Set the next level by the estimate, within the limits; return a fault."""
        allowed, asked = step_control(s, o, c, value, setpoint, upcoming, elapsed_s)
        if not math.isfinite(asked):
            return NOT_A_LEVEL
        s.level = allowed
        if not is_affordable(s, allowed, c.rules.period_s):
            return TOO_MUCH_ENERGY
        return 0

    def begin(s: Record, i: Record, o: Record, c: Record) -> int:
        """Start estimator and controller at rest at the safe level: the first command continues from it."""
        for k in range(oldest + 1):
            s.sent[k] = s.level
        o.estimate, o.surrogate, o.standard_error, o.estimate_status = estimate(s, c, s.level, i.sensed, 0.0)
        value = o.estimate - s.swing if swings else o.estimate
        start_control(s, c, value, i.setpoint)
        return command(s, o, c, value, i.setpoint, i.setpoint, c.rules.period_s)

    def take(state: Record, i: Record, o: Record, c: Record) -> int:
        """Take a sample; return a fault, 0 if there is none."""
        s = state[0]
        s.elapsed_s = i.periods * c.rules.period_s
        held_s = (i.periods - 1) * c.rules.period_s
        if s.settle_left == 0 and i.periods > 1 and not is_affordable(s, s.level, held_s):
            return TOO_MUCH_ENERGY
        if not accepts(state, i):
            return refusal(state, i)
        s.known, s.sensed, s.counter, s.time_us = 1, i.sensed, i.counter, i.time_us
        if s.settle_left > 0:
            s.settle_left -= 1
            return begin(s, i, o, c) if s.settle_left == 0 else 0
        for k in range(oldest):
            s.sent[k] = s.sent[k + 1]
        s.sent[oldest] = s.level
        o.estimate, o.surrogate, o.standard_error, o.estimate_status = estimate(
            s, c, s.sent[0], i.sensed, s.elapsed_s
        )
        value = o.estimate - s.swing if swings else o.estimate
        return command(s, o, c, value, i.setpoint, i.upcoming, s.elapsed_s)

    def sample(state: Record, i: Record, o: Record, c: Record) -> None:
        """Take a sample: from a reading and a setpoint to the next level."""
        s = state[0]
        o.estimate = o.surrogate = o.standard_error = math.nan
        set_zero(o)
        o.estimate_status = 0
        if s.fault == 0:
            s.fault = take(state, i, o, c)
        if s.fault != 0:
            s.level = c.rules.safe
        o.level, o.fault = s.level, s.fault

    return sample
