"""A kind of plant that is controlled without a model: by a PID with gains by hand, or parts of the user."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidController, PidGains
from rtctl.controllers.pid_table import PidTable
from rtctl.models.span import Span
from rtctl.plant_control.support import Control
from rtctl.registry import PlantKind
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario
from rtctl.signals.gains import gain_unit


class WithoutModel:
    """`PlantSupport` of kinds that bring none: no estimator, a PID with gains by hand, `[limits]` as they are."""

    estimators: Mapping[str, Any] = {}
    needs_model = False

    def __init__(self, kind: PlantKind) -> None:
        self._kind = kind

    def read_model(self, path: Path) -> Any:
        """Return the model of the file, which the user's parts get. Raises InputError where the kind reads none."""
        if self._kind.model is None:
            raise InputError(
                f'{path}: a "{self._kind.name}" has no models; leave --model and scenario.model out'
            )
        return self._kind.part(self._kind.model.read)(path)

    def identity(self, model: Any) -> str:
        """Return "": any device will do."""
        return ""

    def unused(self, model: Any) -> tuple[str, ...]:
        """Return nothing: what the user's parts use of a model is not known."""
        return ()

    def output_range(self, scenario: Scenario, model: Any) -> Span:
        """Return the range of believable readings where the first has the output's unit, else that of `[reference]`.

        Raises:
            InputError: neither says in which range the output lies.
        """
        table, sensed, output = scenario.limits, scenario.profile.sensed[0], scenario.profile.reference
        bounds = (table.sensed_low, table.sensed_high)
        if sensed.unit == output.unit and all(abs(bound) < float("inf") for bound in bounds):
            return Span(*bounds)
        raise InputError(
            f"limits.sensed_low and limits.sensed_high of {sensed.name} are needed in {output.unit}: without a "
            "model they say in which range the output lies"
        )

    def reading_at_rest(self, model: Any) -> tuple[float, ...]:
        """Return zeros."""
        return (0.0,) * len(self._kind.profile.sensed)

    def limits(self, scenario: Scenario, model: Any) -> tuple[CommandLimits, ...]:
        """Return those of the scenario."""
        return scenario.limits.of_commands(scenario.profile)

    def control(self, scenario: Scenario, model: Any, delay: int) -> Control:
        """Return a PID with gains by hand. Raises InputError: all other controllers of such a plant are the user's."""
        table, profile, unit = scenario.controller, scenario.profile, gain_unit(scenario.profile)
        if not isinstance(table, PidTable):
            raise InputError(
                f'key "controller.kind": rtctl has no controller for a "{self._kind.name}" but "pid" with kp [{unit}] '
                f'and ki [{unit}/s]; give that, register your own, or name it as "module:Class"'
            )
        if table.kp is None or table.ki is None:
            raise InputError(
                f'[controller]: a "{self._kind.name}" has no model to tune a PID on; give kp [{unit}] and ki [{unit}/s]'
            )
        try:
            gains = PidGains(kp=table.kp, ki=table.ki, kd=table.kd or 0.0)
        except ValueError as error:
            raise InputError(f"[controller]: {error}") from None
        others = tuple(one.safe for one in self.limits(scenario, model)[1:])
        made = PidController(
            gains, unit=profile.commands[0].unit, setpoint_weight=table.setpoint_weight, others=others
        )
        return Control(made, None)

    def predict(self, model: Any, level: Mapping[str, float]) -> dict[str, float]:
        """Return nothing."""
        return {}
