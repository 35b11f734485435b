"""A user's equations in a loop: a Kalman filter and a PID that are made from the model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidController, PidGains
from rtctl.controllers.pid_table import PidTable
from rtctl.controllers.pid_tuning import WorkingPoint, margins_of_gains, tune_pid
from rtctl.estimators.cubature import CubatureFilter
from rtctl.estimators.equations.rest import RestPoint, jacobian, rest_point, rests_anywhere, swept_points
from rtctl.interfaces import Estimator
from rtctl.models.span import Span
from rtctl.plant_control.support import Control
from rtctl.plants.equations.belief import filter_settings
from rtctl.plants.equations.several import decoupled_control
from rtctl.registry.loading import resolved
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario

MODEL = "plant_sim.equations.controlled:ControlledEquations"
WORKING_POINTS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places in the output's range at which the plant is looked at."""
BESIDE = 1e-3
"""Distance from a point of rest at which slopes on one way of a hysteresis are taken, as a share of the command."""
SHARE = 1e-5
"""Step of a finite difference, as a share of the first command's range."""


class EquationsSupport:
    """`PlantSupport` of a user's equations."""

    estimators: Mapping[str, Callable[[StateSpace], Estimator]] = {
        "kalman": lambda model: CubatureFilter(model, filter_settings(model)),
    }

    def read_model(self, path: Path) -> StateSpace:
        """Read a model file. Raises InputError."""
        made: StateSpace = resolved(MODEL, str(path))(path)
        return made

    def identity(self, model: StateSpace) -> str:
        """Return "": a model file of equations is not bound to one device."""
        return ""

    def unused(self, model: StateSpace) -> tuple[str, ...]:
        """Return the mechanisms beside the equations: filter and tuning know the equations alone."""
        return model.left_out

    def output_range(self, scenario: Scenario, model: StateSpace) -> Span:
        """Return the range that the model file gives the output, else that in which its reading is believed."""
        if model.output_range is not None:
            return Span(*model.output_range)
        profile = scenario.profile
        for channel, believed in zip(profile.sensed, scenario.limits.readings(profile), strict=True):
            twice = profile.reference.name == f"reference_{channel.name}"
            if twice and math.isfinite(believed.low) and math.isfinite(believed.high):
                return Span(believed.low, believed.high)
        name = profile.reference.name.removeprefix("reference_")
        raise InputError(
            f"the range of the controlled output is not known: give low and high [{profile.reference.unit}] under "
            f"[device.outputs.{name}] in the model file"
        )

    def reading_at_rest(self, model: StateSpace) -> tuple[float, ...]:
        """Return the readings of the initial states."""
        levels = (0.0,) * len(model.profile.commands)
        return tuple(np.nan_to_num(model.readings(model.initial[None], levels)[0]).tolist())

    def limits(self, scenario: Scenario, model: StateSpace) -> tuple[CommandLimits, ...]:
        """Return those of the scenario."""
        return scenario.limits.of_commands(scenario.profile)

    def control(self, scenario: Scenario, model: StateSpace, delay: int) -> Control:
        """Return a PID with gains from the model, or by hand. Raises InputError."""
        table, profile = scenario.controller, scenario.profile
        if not isinstance(table, PidTable):
            raise InputError(f'controller.kind = "{table.kind}" does not control "equations"; use "pid"')
        _same_channels(model, scenario)
        if scenario.references:
            return decoupled_control(scenario, model, delay)
        units = (profile.commands[0].unit, profile.reference.unit)
        others = tuple(one.safe for one in self.limits(scenario, model)[1:])
        places = _working_points(scenario, model, self.output_range(scenario, model))
        period_s = scenario.scenario.period_s
        try:
            if table.kp is not None and table.ki is not None:
                gains = PidGains(kp=table.kp, ki=table.ki, kd=table.kd or 0.0)
                tuning = margins_of_gains(gains, places.plants, period_s=period_s, delay=delay, units=units)
            else:
                tuning = tune_pid(
                    places.plants,
                    period_s=period_s,
                    delay=delay,
                    maximum_sensitivity=table.maximum_sensitivity,
                    setpoint_weight=table.setpoint_weight,
                    units=units,
                )
        except ValueError as error:
            raise InputError(f"[controller]: {error}") from None
        if places.rests and tuning.gain_margin == 0.0:
            raise InputError(
                f"[controller]: with {tuning.gains.describe(*units)} the loop would be unstable where the device "
                "rests; give less gain, or no gain at all, so that it is tuned on the model"
            )
        tuning = tuning.with_notes(places.notes)
        made = PidController(
            tuning.gains, unit=units[0], setpoint_weight=table.setpoint_weight, others=others
        )
        return Control(made, tuning)

    def predict(self, model: StateSpace, level: Mapping[str, float]) -> dict[str, float]:
        """Return nothing: a settled level depends on its history where the equations hold one."""
        return {}


def _same_channels(model: StateSpace, scenario: Scenario) -> None:
    own, wanted = (
        [(one.name, one.unit) for one in profile.channels] for profile in (model.profile, scenario.profile)
    )
    if own != wanted:
        raise InputError(
            f"the model's channels are {own}, those of the scenario {wanted}: --model and scenario.model differ; "
            "give --set scenario.model=FILE"
        )


class _WorkingPoints(NamedTuple):
    """The plant at some places of the output's range."""

    plants: tuple[WorkingPoint, ...]
    rests: bool
    """Whether the device rests there; else this is the plant about its initial state."""
    notes: tuple[str, ...]
    """What a person must know of these places."""


def _working_points(scenario: Scenario, model: StateSpace, reach: Span) -> _WorkingPoints:
    """Return the plant where it rests over the output's range."""
    limits = scenario.limits.commands(scenario.profile)
    safe = tuple(table.safe_level for table in limits)
    return _points_at_rest(model, safe, (limits[0].low, limits[0].high), reach)


@lru_cache(maxsize=8)
def _points_at_rest(
    model: StateSpace, safe: tuple[float, ...], span: tuple[float, float], reach: Span
) -> _WorkingPoints:
    """Return the plant where it rests over `reach`; kept, since each change of a gain is judged by it."""
    swing = span[1] - span[0]
    asked = [reach.low + share * reach.width for share in WORKING_POINTS]
    points = [rest_point(model, safe, output, swing) for output in asked]
    if any(one.holds and rests_anywhere(model, one, safe) for one in points):
        points = swept_points(model, safe, span, asked)
    held = [one for one in points if one.holds]
    if not held:
        start = RestPoint(model.initial, safe[0], holds=False)
        note = "tuned at the initial state: the device rests nowhere in the output's range"
        return _WorkingPoints((linear_plant(model, start, safe, swing),), rests=False, notes=(note,))
    output, command = model.profile.reference, model.profile.commands[0]
    notes = tuple(
        f"rest at {float(model.controlled(one.x[None], (one.level, *safe[1:]))[0]):.4g} {output.unit} takes "
        f"{one.level:.4g} {command.unit}, beyond the limits of {command.name}"
        for one in held
        if not span[0] <= one.level <= span[1]
    )
    return _WorkingPoints(tuple(linear_plant(model, one, safe, swing) for one in held), True, notes)


def linear_plant(model: StateSpace, point: RestPoint, safe: Sequence[float], swing: float) -> WorkingPoint:
    """Return the slopes of the equations about a point of rest, with hysteresis those of the way on which it lies.

    They are taken at two small distances on that way, and extrapolated to the point of rest itself.
    """
    if point.side == 0:
        return _slopes(model, point, safe, swing)
    near, far = (
        _slopes(model, point._replace(level=point.level + point.side * share * swing), safe, swing)
        for share in (0.5 * BESIDE, BESIDE)
    )
    return WorkingPoint(
        a=2.0 * near.a - far.a, b=2.0 * near.b - far.b, c=2.0 * near.c - far.c, d=2.0 * near.d - far.d
    )


def _slopes(model: StateSpace, point: RestPoint, safe: Sequence[float], swing: float) -> WorkingPoint:
    levels, step = (point.level, *safe[1:]), SHARE * swing
    up, down = ((point.level + sign * step, *safe[1:]) for sign in (1.0, -1.0))
    x = point.x[None]
    b = (model.rates(x, up) - model.rates(x, down))[0] / (2.0 * step)
    d = float((model.controlled(x, up) - model.controlled(x, down))[0] / (2.0 * step))
    return WorkingPoint(
        a=jacobian(model, point.x, levels), b=b, c=_output_slopes(model, point.x, levels), d=d
    )


def _output_slopes(model: StateSpace, x: FloatArray, levels: Sequence[float]) -> FloatArray:
    steps = SHARE * SHARE * np.maximum(np.abs(x), SHARE)
    up = model.controlled(x + np.diag(steps), levels)
    return np.asarray((up - model.controlled(x - np.diag(steps), levels)) / (2.0 * steps))
