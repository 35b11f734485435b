"""Discrete PID with anti-windup and bumpless start; the derivative is that of the estimate, filtered.

    u[k] = P[k] + I[k] + D[k],   P = kp (b setpoint - y),   I[k] = I[k-1] + ki (setpoint - y) h,   y the estimate
    D[k] = Tf/(Tf + h) D[k-1] - kd/(Tf + h) (y[k] - y[k-1]),   Tf = kd/(kp N)

A setpoint weight b below 1 keeps the overshoot of a step small without a slower answer to loads. State: the integral
and derivative terms [command unit], so a change of a gain does not bump.
Reference: K. J. Astrom, T. Hagglund, Advanced PID Control, section 3.5, equations 3.29 to 3.32.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from rtctl.interfaces import ControlAction, Estimate

FILTER_RATIO = 8.0
"""N: derivative time over the time constant of its filter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PidGains:
    """Gains of a PID, all of one sign, in units of command and output."""

    kp: float
    """Proportional gain [command/output]."""
    ki: float
    """Integral gain [command/(output s)]."""
    kd: float = 0.0
    """Derivative gain [command s/output]."""

    def __post_init__(self) -> None:
        gains = (self.kp, self.ki, self.kd)
        if not all(map(math.isfinite, gains)) or min(gains) < 0.0 < max(gains) or self.ki == 0.0:
            raise ValueError(
                f"PID gains must be finite, of one sign, and ki not 0, got kp = {self.kp!r}, ki = {self.ki!r}, "
                f"kd = {self.kd!r}"
            )
        if self.kd != 0.0 and self.kp == 0.0:
            raise ValueError(f"kd = {self.kd!r} needs kp: the derivative's filter is kd/kp/{FILTER_RATIO:g}")

    def describe(self, command: str, output: str) -> str:
        """Return the gains in words, in units of command and output."""
        return (
            f"kp = {self.kp:.4g} {command}/{output}, ki = {self.ki:.4g} {command}/({output} s), "
            f"kd = {self.kd:.4g} {command} s/{output}"
        )

    @property
    def filter_s(self) -> float:
        """Time constant [s] of the derivative's filter."""
        return 0.0 if self.kd == 0.0 else self.kd / self.kp / FILTER_RATIO


class PidParams(NamedTuple):
    """Parameters of `pid_step`, in units of command and output."""

    kp: float
    """[command/output]."""
    ki: float
    """[command/(output s)]."""
    kd: float
    """[command s/output]."""
    filter_s: float
    """Time constant of the derivative's filter [s]."""
    weight: float
    """Share of the setpoint in the proportional term."""


@dataclass(slots=True)
class PidMemory:
    """Memory of `pid_step`."""

    integral: float = 0.0
    """[command]."""
    derivative: float = 0.0
    """[command]."""
    before: float = 0.0
    """The estimate before [output]."""
    error: float = 0.0
    """The last weighted error [output]."""
    asked: float = 0.0
    """The level that was asked for last [command]."""


def pid_start(s: Any, p: PidParams, level: float, setpoint: float, value: float) -> None:
    """Start so that the first command equals `level`, whatever the first error is; `PidMemory` in place."""
    s.error = p.weight * setpoint - value
    s.before, s.derivative = value, 0.0
    s.integral = level - p.kp * s.error


def pid_step(s: Any, p: PidParams, setpoint: float, value: float, elapsed_s: float) -> float:
    """Return the proportional term [command]; advance `PidMemory`, with what is asked for, in place.

    Args:
        s: the memory.
        p: parameters.
        setpoint: [output].
        value: the estimate [output].
        elapsed_s: time since the step before [s].
    """
    s.error = p.weight * setpoint - value
    s.integral += p.ki * (setpoint - value) * elapsed_s
    if p.kd != 0.0:
        whole_s = p.filter_s + elapsed_s
        s.derivative = (p.filter_s * s.derivative - p.kd * (value - s.before)) / whole_s
    s.before = value
    proportional = p.kp * s.error
    s.asked = proportional + s.integral + s.derivative
    return float(proportional)


def pid_applied(s: Any, level: float) -> None:
    """Take back from the integral term what the limits did not let through (anti-windup), in place."""
    if level != s.asked:
        s.integral += level - s.asked


class PidController:
    """PID of the first command; further commands stay at `others` (`rtctl.interfaces.Controller`)."""

    preview_s = 0.0

    def __init__(
        self, gains: PidGains, *, unit: str, setpoint_weight: float = 1.0, others: Sequence[float] = ()
    ) -> None:
        """Build the controller.

        Args:
            gains: Its gains.
            unit: Unit of the first command.
            setpoint_weight: b, between 0 and 1.
            others: Levels at which the further commands are held, each in its unit.
        """
        self.gains, self._weight = gains, float(setpoint_weight)
        self.terms = tuple((name, unit) for name in ("proportional", "integral", "derivative"))
        self._others = tuple(others)
        self._memory = PidMemory()

    @property
    def params(self) -> PidParams:
        """What the functions of the controller take."""
        gains = self.gains
        return PidParams(
            float(gains.kp), float(gains.ki), float(gains.kd), float(gains.filter_s), self._weight
        )

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start so that the first command equals the applied level, whatever the first error is."""
        pid_start(self._memory, self.params, levels[0], setpoint, estimate.value)

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Return the command and its terms; see `Controller`."""
        s = self._memory
        proportional = pid_step(s, self.params, setpoint, estimate.value, elapsed_s)
        return ControlAction((s.asked, *self._others), (proportional, s.integral, s.derivative))

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from the integral term what the limits did not let through (anti-windup)."""
        pid_applied(self._memory, levels[0])

    def parameters(self) -> dict[str, float]:
        """Return the gains, which can be changed while the loop runs, by their names in a scenario."""
        return {f"controller.{name}": getattr(self.gains, name) for name in ("kp", "ki", "kd")}

    def change(self, name: str, value: float) -> None:
        """Change a gain from the next step on; the integral term takes over what the proportional term gives up.

        Raises:
            ValueError: The gains would not be finite or not of one sign.
        """
        before, s = self.gains, self._memory
        self.gains = replace(before, **{name.removeprefix("controller."): value})
        s.integral += (before.kp - self.gains.kp) * s.error
        if self.gains.kd == 0.0:
            s.integral, s.derivative = s.integral + s.derivative, 0.0
