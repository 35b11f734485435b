"""Discrete PI with anti-windup, bumpless start and an optional feedforward.

    u[k] = f[k] + P[k] + I[k],   P[k] = kp e[k],   I[k] = I[k-1] + ki e[k] h,   e = deadband(setpoint - estimate)

State: the integral term I [command unit], so a change of ki does not bump. Where a limit holds the command back,
I gives up what did not get through (back-calculation in one step), so no error winds up behind a limit.
The deadband ends the hunting of an integrator across a hysteresis gap, where the plant's own gain is negative.
Reference: K. J. Astrom, T. Hagglund, Advanced PID Control, section 3.5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from rtctl.border.kernels import kernel
from rtctl.interfaces import ControlAction, Estimate

TERMS = ("proportional", "integral", "feedforward")


class PiState(NamedTuple):
    """State of a PI: integral term [mA] and last error [um]; a change of kp keeps their sum of terms."""

    integral: float
    error: float


class CommandTerms(NamedTuple):
    """Terms of a command [mA]; their names are `TERMS`."""

    proportional: float
    integral: float
    feedforward: float


@kernel
def beyond_deadband(error: float, deadband: float) -> float:
    """Return the part of an error beyond the deadband, continuous at its edges; NaN stays NaN and ends the run."""
    if error > deadband:
        return error - deadband
    if error < -deadband:
        return error + deadband
    return 0.0 if error == error else error


@kernel
def pi_step(
    integral: float, deviation: float, elapsed_s: float, kp: float, ki: float, deadband: float
) -> tuple[float, float, float]:
    """Return error [um], proportional and integral term [mA] of one step.

    Args:
        integral: integral term of the step before [mA].
        deviation: setpoint less estimate [um].
        elapsed_s: time since the step before [s].
        kp: proportional gain [mA/um].
        ki: integral gain [mA/(um s)].
        deadband: half width of the deadband [um].
    """
    error = beyond_deadband(deviation, deadband)
    return error, kp * error, integral + ki * error * elapsed_s


@dataclass(frozen=True, slots=True, kw_only=True)
class PiGains:
    """Gains of a PI controller."""

    kp: float
    """Proportional gain [mA/um], >= 0."""
    ki: float
    """Integral gain [mA/(um s)], > 0."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.kp < math.inf or not 0.0 < self.ki < math.inf:
            raise ValueError(
                f"PI gains need kp >= 0 mA/um and ki > 0 mA/(um s), got {self.kp!r}, {self.ki!r}"
            )


class Feedforward(Protocol):
    """A feedforward: setpoint to command by a model of the plant."""

    preview_s: float
    """How far beyond the next sample the setpoint is looked at [s]."""

    def start(self, level: float) -> float:
        """Forget the past; return the command [mA] that the model holds for the applied `level` [mA]."""
        ...

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """Return the command [mA] that brings the model's output to `upcoming` [um] in one period."""
        ...


class NoFeedforward:
    """No feedforward: the PI alone."""

    preview_s = 0.0

    def start(self, level: float) -> float:
        """Return 0 mA."""
        return 0.0

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """Return 0 mA."""
        return 0.0


class PiController:
    """PI controller of the first command (`rtctl.interfaces.Controller`)."""

    def __init__(self, gains: PiGains, feedforward: Feedforward, *, deadband: float) -> None:
        self.gains = gains
        self.deadband = deadband
        self.terms = tuple((name, "mA") for name in TERMS)
        self.preview_s = feedforward.preview_s
        self.feedforward = feedforward
        self._integral = 0.0
        self._asked = 0.0
        self._error = 0.0

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start so that the first command equals the applied level, whatever the first error is."""
        assumed = self.feedforward.start(levels[0])
        self._error = beyond_deadband(setpoint - estimate.settled, self.deadband)
        self._integral = levels[0] - assumed - self.gains.kp * self._error

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Return the command and its terms; see `Controller`."""
        gains = self.gains
        self._error, proportional, self._integral = pi_step(
            self._integral, setpoint - estimate.settled, elapsed_s, gains.kp, gains.ki, self.deadband
        )
        forward = self.feedforward.step(upcoming, elapsed_s)
        self._asked = proportional + self._integral + forward
        return ControlAction((self._asked,), CommandTerms(proportional, self._integral, forward))

    def parameters(self) -> dict[str, float]:
        """Return the gains, which can be changed while the loop runs, by their names in a scenario."""
        return {"controller.kp": self.gains.kp, "controller.ki": self.gains.ki}

    def change(self, name: str, value: float) -> None:
        """Change a gain from the next step on; the integral term takes over what the proportional term gives up.

        Raises:
            ValueError: the gain is negative or not finite.
        """
        if name == "controller.ki":
            self.gains = PiGains(kp=self.gains.kp, ki=value)
            return
        gains = PiGains(kp=value, ki=self.gains.ki)
        self._integral += (self.gains.kp - value) * self._error
        self.gains = gains

    def state(self) -> PiState:
        """Return what is kept between two steps."""
        return PiState(self._integral, self._error)

    def resume(self, state: PiState) -> None:
        """Go on from `state`."""
        self._integral, self._error = state

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from the integral term what the limits did not let through (anti-windup)."""
        if levels[0] != self._asked:
            self._integral += levels[0] - self._asked
