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
        self.gains, self._weight = gains, setpoint_weight
        self.terms = tuple((name, unit) for name in ("proportional", "integral", "derivative"))
        self._others = tuple(others)
        self._integral = self._derivative = self._asked = self._error = self._before = 0.0

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start so that the first command equals the applied level, whatever the first error is."""
        self._error = self._weight * setpoint - estimate.value
        self._before, self._derivative = estimate.value, 0.0
        self._integral = levels[0] - self.gains.kp * self._error

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Return the command and its terms; see `Controller`."""
        gains, value = self.gains, estimate.value
        self._error = self._weight * setpoint - value
        self._integral += gains.ki * (setpoint - value) * elapsed_s
        if gains.kd != 0.0:
            whole = gains.filter_s + elapsed_s
            self._derivative = (gains.filter_s * self._derivative - gains.kd * (value - self._before)) / whole
        self._before = value
        proportional = gains.kp * self._error
        self._asked = proportional + self._integral + self._derivative
        return ControlAction((self._asked, *self._others), (proportional, self._integral, self._derivative))

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from the integral term what the limits did not let through (anti-windup)."""
        if levels[0] != self._asked:
            self._integral += levels[0] - self._asked

    def parameters(self) -> dict[str, float]:
        """Return the gains, which can be changed while the loop runs, by their names in a scenario."""
        return {f"controller.{name}": getattr(self.gains, name) for name in ("kp", "ki", "kd")}

    def change(self, name: str, value: float) -> None:
        """Change a gain from the next step on; the integral term takes over what the proportional term gives up.

        Raises:
            ValueError: The gains would not be finite or not of one sign.
        """
        before = self.gains
        self.gains = replace(before, **{name.removeprefix("controller."): value})
        self._integral += (before.kp - self.gains.kp) * self._error
        if self.gains.kd == 0.0:
            self._integral, self._derivative = self._integral + self._derivative, 0.0
