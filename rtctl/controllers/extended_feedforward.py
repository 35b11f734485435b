"""Feedforward through an extended model: the current that, when it acts, puts the deflection on the setpoint.

As `rtctl.controllers.feedforward`, with the path of the estimator for a model. A dead time of d means that what is
commanded now decides the deflection d later, so the setpoint is looked at that far ahead (`preview_s`). Where the
transition lags the temperature by tau_d, one period cannot move it: the current is the one that, held for
1 + tau_d / h periods, would bring it there, worked out anew at each sample.
"""

from __future__ import annotations

import math

from rtctl.controllers.feedforward import STILL, InverseParams, walk_to
from rtctl.estimators.thermal_path import Drive, ThermalPath, path_params
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

MOST_PERIODS = 8
SECANTS = 3
APART_MA2 = 1.0
"""Distance of the two powers from which a secant starts [mA^2]."""
NO_HEAT = 0.0
"""Heat besides the current's [mA^2]: none."""


class ExtendedFeedforward:
    """The feedforward of a model with mechanisms."""

    def __init__(self, model: Vo2Model, dynamics: Vo2Dynamics, command: Span, period_s: float) -> None:
        """Prepare for a model; `command`: the range that the limits allow [mA]."""
        self._command, self._dynamics = command, dynamics
        self._path = ThermalPath(model, path_params(model, dynamics))
        self._drive = Drive(_undelayed(dynamics))
        self._deflection = model.deflection_preisach.params
        low, high = (dynamics.current.of(end) for end in command)
        self._inverse = InverseParams(
            model.time_constant_s, min(low, high), max(low, high), STILL * model.deflection.width
        )
        self._periods = 1 + min(math.ceil(dynamics.balance.lag_s / period_s), MOST_PERIODS - 1)
        self.preview_s = dynamics.delay_s + (self._periods - 1) * period_s
        self._time_s = 0.0
        self._wanted = 0.0

    def start(self, level: float) -> float:
        """Start at rest at the applied level, from a full cooling; see `Feedforward`."""
        self._path.start(self._drive.start(level))
        self._time_s = 0.0
        self._wanted = self._path.seen
        return level

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """Return the command [mA] for the next period; `upcoming` [um] is the setpoint `preview_s` beyond its end."""
        target = self._dynamics.deflection.back(upcoming)
        wanted = walk_to(self._path.beam, target, self._path.seen, self._inverse, self._deflection)
        power = self._power_to(self._path.power_of(wanted), self._periods * elapsed_s)
        current = min(max(self._path.current_of(power), self._inverse.low), self._inverse.high)
        command = min(max(self._dynamics.current.back(current), self._command.low), self._command.high)
        for heating, duration_s in self._drive.pieces(command, elapsed_s):
            self._path.step(heating, NO_HEAT, self._time_s, duration_s)
        self._time_s += elapsed_s
        return command

    def _power_to(self, seen: float, duration_s: float) -> float:
        """Return the constant power [mA^2] that brings what the relays see to `seen` [mA^2] in `duration_s` [s]."""
        first, second = seen, seen + APART_MA2
        reached = self._path.reached(first, self._time_s, duration_s)
        for _ in range(SECANTS):
            there = self._path.reached(second, self._time_s, duration_s)
            if there == reached:
                break
            following = second + (seen - there) * (second - first) / (there - reached)
            first, second, reached = second, min(max(following, -400.0), 4.0 * seen + 400.0), there
            if abs(second - first) < 1e-6:
                break
        return second


def _undelayed(dynamics: Vo2Dynamics) -> Vo2Dynamics:
    """Return the model without its delay: the feedforward's model lives when its commands arrive."""
    from dataclasses import replace

    return replace(dynamics, delay_s=0.0)
