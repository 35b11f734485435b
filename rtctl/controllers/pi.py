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

from rtctl.interfaces import ControlAction, Estimate

TERMS = ("proportional", "integral", "feedforward")


class PiTerms(NamedTuple):
    """The terms of one step [command unit]."""

    proportional: float
    integral: float


class PiState(NamedTuple):
    """The integral term [command unit] and the last error [um], which a change of kp is to leave without effect."""

    integral: float
    error: float


class CommandTerms(NamedTuple):
    """What a command is the sum of, as `TERMS` names it [command unit]."""

    proportional: float
    integral: float
    feedforward: float


def pi_step(integral: float, error: float, elapsed_s: float, kp: float, ki: float) -> PiTerms:
    """One PI step: the new terms. `integral` [mA], `error` [um], kp [mA/um], ki [mA/(um s)]."""
    return PiTerms(kp * error, integral + ki * error * elapsed_s)


def beyond(error: float, deadband: float) -> float:
    """What of an error lies beyond the deadband, continuous at its edges; NaN stays NaN and ends the run."""
    if error > deadband:
        return error - deadband
    if error < -deadband:
        return error + deadband
    return 0.0 if error == error else error


@dataclass(frozen=True, slots=True, kw_only=True)
class PiGains:
    """kp [mA/um] and ki [mA/(um s)]."""

    kp: float
    ki: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.kp < math.inf or not 0.0 < self.ki < math.inf:
            raise ValueError(
                f"PI gains need kp >= 0 mA/um and ki > 0 mA/(um s), got {self.kp!r}, {self.ki!r}"
            )


class Feedforward(Protocol):
    """Setpoint to a command level by a model of the plant."""

    preview_s: float
    """How far beyond the next sample it looks at the setpoint."""

    def start(self, level: float) -> float:
        """Forget the past; the command [mA] that the model holds for the applied level."""
        ...

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """The command [mA] that brings the model's output to `upcoming` [um] in one period."""
        ...


class NoFeedforward:
    """The PI alone."""

    preview_s = 0.0

    def start(self, level: float) -> float:
        """0."""
        return 0.0

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """0."""
        return 0.0


class PiController:
    """PI on the first command channel; `Controller` of the loop."""

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
        """The first command equals the applied level whatever the first error is."""
        assumed = self.feedforward.start(levels[0])
        self._error = beyond(setpoint - estimate.value, self.deadband)
        self._integral = levels[0] - assumed - self.gains.kp * self._error

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """P, I and feedforward of one sample."""
        error = self._error = beyond(setpoint - estimate.value, self.deadband)
        terms = pi_step(self._integral, error, elapsed_s, self.gains.kp, self.gains.ki)
        forward = self.feedforward.step(upcoming, elapsed_s)
        self._integral = terms.integral
        self._asked = terms.proportional + terms.integral + forward
        return ControlAction((self._asked,), CommandTerms(*terms, forward))

    def parameters(self) -> dict[str, float]:
        """What can be changed while the loop runs, by name as in a scenario."""
        return {"controller.kp": self.gains.kp, "controller.ki": self.gains.ki}

    def change(self, name: str, value: float) -> None:
        """Another gain from the next step on; the integral takes over what the proportional term gives up.

        Raises ValueError on one that it cannot have.
        """
        if name == "controller.ki":
            self.gains = PiGains(kp=self.gains.kp, ki=value)
            return
        gains = PiGains(kp=value, ki=self.gains.ki)
        self._integral += (self.gains.kp - value) * self._error
        self.gains = gains

    def state(self) -> PiState:
        """What it keeps between two steps."""
        return PiState(self._integral, self._error)

    def resume(self, state: PiState) -> None:
        """As if it had come there by itself."""
        self._integral, self._error = state

    def applied(self, levels: Sequence[float]) -> None:
        """Anti-windup."""
        if levels[0] != self._asked:
            self._integral += levels[0] - self._asked
