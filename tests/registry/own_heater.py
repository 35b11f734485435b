"""A user's file: a heater in volt and degrees as a plant, an integral controller, a filtering estimator."""

from __future__ import annotations

import math
from collections.abc import Sequence

import rtctl
from rtctl.border.records import device_profile
from rtctl.interfaces import ControlAction, Estimate, Setup


@rtctl.register("plant", "heater")
class Heater:
    """A heater of the first order with a thermometer."""

    profile = device_profile(
        "heater", commands={"voltage": "V"}, sensed={"reading": "K"}, reference=("temperature", "K")
    )
    identity = "heater-1"
    low, high, safe = (0.0,), (10.0,), (0.0,)

    def __init__(self, gain: float = 4.0, time_constant_s: float = 0.05) -> None:
        if not time_constant_s > 0.0:
            raise ValueError(f"time_constant_s must be > 0 s, got {time_constant_s!r}")
        self._gain, self._time_constant_s = gain, time_constant_s
        self.reset()

    def reset(self) -> None:
        self._temperature = 0.0

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        aim = self._gain * levels[0]
        self._temperature = aim + (self._temperature - aim) * math.exp(-dt_s / self._time_constant_s)

    def measure(self) -> tuple[tuple[float, ...], float]:
        return (self._temperature,), self._temperature

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        self.advance(levels, dt_s)
        return self.measure()


@rtctl.register("controller", "integral", summary="integral of the error")
class Integral:
    terms = (("integral", "V"),)
    preview_s = 0.0

    def __init__(self, setup: Setup, rate: float = 5.0) -> None:
        if not rate > 0.0:
            raise ValueError(f"rate must be > 0 V/(K*s), got {rate!r}")
        self._rate, self._low, self._high = rate, setup.low[0], setup.high[0]

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        self._level = levels[0]

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        self._level += self._rate * (setpoint - estimate.value) * elapsed_s
        return ControlAction((self._level,), (self._level,))

    def applied(self, levels: Sequence[float]) -> None:
        self._level = levels[0]


@rtctl.register("estimator", "smoothed")
class Smoothed:
    """First-order low-pass of the reading."""

    surrogate = ("unfiltered", "K")

    def __init__(self, time_constant_s: float = 5e-3) -> None:
        self._time_constant_s = time_constant_s

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        self._value = sensed[0]
        return Estimate(self._value, sensed[0], math.nan, 0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        self._value += (sensed[0] - self._value) * -math.expm1(-elapsed_s / self._time_constant_s)
        return Estimate(self._value, sensed[0], math.nan, 0)
