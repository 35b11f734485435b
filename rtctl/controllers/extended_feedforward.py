"""Feedforward through an extended model: the current that, when it acts, puts the deflection on the setpoint.

As `rtctl.controllers.feedforward`, with the path of the estimator for a model. A dead time of d means that what is
commanded now decides the deflection d later, so the setpoint is looked at that far ahead (`preview_s`). A transition
that lags the temperature is a dead time here (`rtctl.plants.vo2.control`): no current inverts it at a reversal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.controllers.feedforward import STILL, InverseParams, walk_to
from rtctl.estimators.drive import Drive, DriveParams, heating_current, later
from rtctl.estimators.thermal_path import (
    SEEN,
    PathParams,
    ThermalPath,
    path_params,
    path_step,
    reached,
    settle_path,
    surrogate_at,
)
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.hysteresis.preisach.model import PreisachParams
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.heat import heating_power, loop_current
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

SECANTS = 3
APART_MA2 = 1.0
"""Distance of the two powers from which a secant starts [mA^2]."""
NO_HEAT = 0.0
"""Heat besides the current's [mA^2]: none."""


class AheadParams(NamedTuple):
    """What the feedforward asks of the path."""

    low: float
    """Commands that the limits allow [mA]."""
    high: float
    deflection_gain: float
    deflection_offset: float
    """Map from the deflection of the loops to that of the beam [um]."""


class ForwardConstants(NamedTuple):
    """Parameters of `extended_inverse_step`."""

    inverse: InverseParams
    ahead: AheadParams
    forward_path: PathParams
    forward_drive: DriveParams
    resistance: PreisachParams
    deflection: PreisachParams


@dataclass(slots=True)
class ForwardMemory:
    """Memory of `extended_inverse_step`."""

    forward_path: FloatArray
    """State of `rtctl.estimators.thermal_path`, with the stacks of -ln R and of deflection beside it."""
    forward_film: FloatArray
    forward_beam: FloatArray
    forward_drive: FloatArray
    """Memory of `rtctl.estimators.drive`."""
    forward_clock: FloatArray
    """(2,) time since the start and its rounding [s]."""


# 9 parameters because it takes those of `reached`
@kernel
def power_to(  # noqa: PLR0913
    x: FloatArray, film: FloatArray, beam: FloatArray, seen: float, time_s: float, duration_s: float, p: PathParams,
    r: PreisachParams, d: PreisachParams,
) -> float:  # fmt: skip
    """Return the constant power [mA^2] that brings what the relays see to a value, by secants; nothing advances.

    Args:
        x: state.
        film: relays of the resistance model.
        beam: relays of the deflection model.
        seen: what the relays are to see [mA^2].
        time_s: time at the start [s].
        duration_s: how long the power is held [s].
        p: parameters.
        r: parameters of the resistance model.
        d: parameters of the deflection model.
    """
    first, second = seen, seen + APART_MA2
    there = reached(x, film, beam, first, time_s, duration_s, p, r, d)
    for _ in range(SECANTS):
        beyond = reached(x, film, beam, second, time_s, duration_s, p, r, d)
        if beyond == there or abs(second - first) < 1e-6:
            break
        following = second + (seen - beyond) * (second - first) / (beyond - there)
        first, there = second, beyond
        second = min(max(following, -400.0), 4.0 * seen + 400.0)
    return second


def extended_inverse_step(s: Any, c: Any, upcoming: float, elapsed_s: float) -> Any:
    """Return the command [mA] for the next period; advance `ForwardMemory` in place.

    Args:
        s: the memory.
        c: fields of `ForwardConstants`.
        upcoming: the setpoint when the command acts [um].
        elapsed_s: how long the command will be held [s].
    """
    balance = c.forward_path.balance
    target = (upcoming - c.ahead.deflection_offset) / c.ahead.deflection_gain
    seen = surrogate_at(s.forward_path[SEEN], balance)
    wanted = walk_to(s.forward_beam, target, seen, c.inverse, c.deflection)
    power = power_to(
        s.forward_path, s.forward_film, s.forward_beam, heating_power(wanted, balance), s.forward_clock[0],
        elapsed_s, c.forward_path, c.resistance, c.deflection,
    )  # fmt: skip
    current = min(max(loop_current(power, balance), c.inverse.low), c.inverse.high)
    level = (current - c.forward_drive.offset) / c.forward_drive.gain
    level = min(max(level, c.ahead.low), c.ahead.high)
    heating = heating_current(s.forward_drive, level, c.forward_drive)
    path_step(
        s.forward_path, s.forward_film, s.forward_beam, heating, NO_HEAT, s.forward_clock[0], elapsed_s,
        c.forward_path, c.resistance, c.deflection,
    )  # fmt: skip
    later(s.forward_clock, elapsed_s)
    return level


class ExtendedFeedforward:
    """The feedforward of a model with mechanisms."""

    def __init__(self, model: Vo2Model, dynamics: Vo2Dynamics, command: Span) -> None:
        """Prepare for a model; `command`: the range that the limits allow [mA]."""
        self._path = ThermalPath(model, path_params(model, dynamics))
        self._drive = Drive(replace(dynamics, delay_s=0.0))  # its model lives when its commands arrive
        low, high = (dynamics.current.of(end) for end in command)
        inverse = InverseParams(
            model.time_constant_s, min(low, high), max(low, high), STILL * model.deflection.width
        )
        self.preview_s = dynamics.delay_s
        self.constants = ForwardConstants(
            inverse, AheadParams(*map(float, (*command, *dynamics.deflection))), self._path.params,
            self._drive.params, model.resistance_preisach.params, model.deflection_preisach.params,
        )  # fmt: skip
        self.memory = self.at_rest(command.low)

    def at_rest(self, level: float) -> ForwardMemory:
        """Return the memory at rest at an applied level [mA], from a full cooling."""
        self._path.start(self._drive.start(level))
        path = self._path
        return ForwardMemory(path.x, path.film, path.beam, self._drive.memory, np.zeros(2))

    def start(self, level: float) -> float:
        """Start at rest at the applied level, from a full cooling; see `Feedforward`."""
        self.memory = self.at_rest(level)
        return level

    def inherit(self, memory: FilmMemory) -> None:
        """Take over what the film has been through; see `rtctl.hysteresis.film_memory`."""
        own, constants = self.memory, self.constants
        own.forward_film[:], own.forward_beam[:] = memory.film, memory.beam
        settle_path(
            own.forward_path, own.forward_film, own.forward_beam, memory.power, constants.forward_path,
            constants.resistance, constants.deflection,
        )  # fmt: skip

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """Return the command [mA] for the next period; `upcoming` [um] is the setpoint `preview_s` beyond its end."""
        return float(extended_inverse_step(self.memory, self.constants, upcoming, elapsed_s))
