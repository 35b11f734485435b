"""What a change of a running loop is held to: a set-point to the model's range, gains to the margins that they leave.

Margins are those of the model at its steepest working point, as the tuning states them. Gains by which the loop would
be unstable are refused; gains with less than the margins of `[controller]` are taken, and the answer says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel

from rtctl.border.errors import InputError
from rtctl.interfaces import Controller
from rtctl.loop.live_parameters import SETPOINT, Change, ParameterChannel
from rtctl.loop.step import parameters_of
from rtctl.loop.successor import Successor
from rtctl.models.span import Span
from rtctl.output.readable_units import readable
from rtctl.scenario.schema import Scenario
from rtctl.session.live.successors import Successors
from rtctl.wiring import build_control

CONTROLLER = "controller."
GAINS = ("kp", "ki", "kd")
"""Parameters of a controller whose sign makes its feedback negative."""
TOLERANCE = 1e-3
"""Relative: the tuning meets its margins to this."""


class ChangeRules:
    """Judges changes before they are offered to the loop, in the thread that asks for them."""

    def __init__(self, scenario: Scenario, model: Any, controller: Controller, reach: Span) -> None:
        """Remember what a run consists of.

        Args:
            scenario: the checked scenario.
            model: the identified model.
            controller: the controller as it was built; its parameters are the first values.
            reach: range of the model's output [its unit].
        """
        self._scenario, self._model, self._reach = scenario, model, reach
        self.current: dict[str, float] = dict(parameters_of(controller))
        """Parameters of the controller with the changes that were taken."""
        self._built = dict(self.current)
        self._before: dict[str, float] = {}

    def judge_changes_of(self, channel: ParameterChannel) -> None:
        """Judge all changes that are offered to `channel`, and take back those that its loop refuses."""
        channel.judge, channel.parameters, channel.refuse = self.judge, lambda: self.current, self.take_back

    def judge(self, name: str, value: float) -> str:
        """Return what to say of a change, "" where nothing; take it as made until the loop refuses it.

        Raises:
            InputError: the set-point lies outside of the model's range, the controller has no such parameter, or the
                loop would be unstable.
        """
        if name == SETPOINT:
            self._judge_setpoint(value)
            return ""
        if name not in self.current:
            raise InputError(
                f"{name} = {value:.4g}: the controller of this run has no such parameter; it has "
                f"{', '.join(sorted(self.current)) or 'none that can be changed'}"
            )
        self._judge_sign(name, value)
        said = self._judge_gains({**self.current, name: value})
        self._before[name], self.current[name] = self.current[name], value
        return said

    def take_back(self, change: Change) -> None:
        """Forget a change that the loop refused: later ones are judged beside the value in force."""
        if self.current.get(change.name) == change.value and change.name in self._before:
            self.current[change.name] = self._before[change.name]

    def follows(self, successors: Successors) -> Callable[[int], tuple[Successor, str]]:
        """Return how another model is prepared, whose gains are those in force from then on."""

        def prepare(number: int) -> tuple[Successor, str]:
            prepared, said = successors.prepare(number)
            if successors.made is not None:
                self._model, self.current = successors.made[0], dict(parameters_of(successors.made[1]))
            return prepared, said

        return prepare

    def _judge_setpoint(self, value: float) -> None:
        if self._scenario.reference is None or math.isnan(value):
            return
        low, high, unit = self._reach.low, self._reach.high, self._scenario.profile.reference.unit
        if not low <= value <= high:
            raise InputError(
                f"setpoint = {readable(value, unit)}: the model reaches {readable(low, unit)} to "
                f"{readable(high, unit)}; give a set-point within it"
            )

    def _judge_sign(self, name: str, value: float) -> None:
        """Raise InputError where a gain would act against the one in force: feedback that drives the error up."""
        now = self.current[name] or self._built.get(name, 0.0)
        if name.removeprefix(CONTROLLER) in GAINS and value * now < 0.0:
            raise InputError(
                f"{name} = {value:.4g}: is of the other sign than the {now:.4g} that the loop has or began with, and "
                "would drive the error up instead of down; give a gain of that sign, or 0"
            )

    def _judge_gains(self, gains: Mapping[str, float]) -> str:
        table = self._scenario.controller
        names = {name.removeprefix(CONTROLLER): value for name, value in gains.items()}
        if not isinstance(table, BaseModel) or not all(hasattr(table, name) for name in names):
            return ""
        try:
            scenario = self._scenario.model_copy(update={"controller": table.model_copy(update=names)})
            tuning = build_control(scenario, self._model).tuning
        except ValueError:
            return ""  # no gains at all: the controller says so itself
        margin, phase_deg = getattr(tuning, "gain_margin", None), getattr(tuning, "phase_margin_deg", None)
        if margin is None or phase_deg is None:
            return ""
        said = f"gain margin {margin:.3g}, phase margin {phase_deg:.3g} deg"
        if margin <= 1.0 or phase_deg <= 0.0:
            asked = ", ".join(f"{name} = {value:.4g}" for name, value in names.items())
            raise InputError(
                f"with {asked} the loop would be unstable at the model's steepest slope ({said}); give less gain"
            )
        least, least_deg = (
            getattr(table, "gain_margin", 0.0),
            math.degrees(getattr(table, "phase_margin_rad", 0.0)),
        )
        if margin < least * (1.0 - TOLERANCE) or phase_deg < least_deg * (1.0 - TOLERANCE):
            return f"{said}: less than the {least:.3g} and {least_deg:.3g} deg of [controller]"
        return said
