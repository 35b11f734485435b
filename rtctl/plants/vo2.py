"""The VO2 actuator: a current through a film that senses itself, deflection controlled by a PI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import Feedforward, NoFeedforward, PiController, PiGains
from rtctl.controllers.tuning import Tuning, margins, tune
from rtctl.estimators import ESTIMATORS
from rtctl.interfaces import Estimator
from rtctl.limits import CommandLimits
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model, read_model
from rtctl.models.working_range import WorkingRange, working_range
from rtctl.plants.support import Control
from rtctl.scenario import PiTable, Scenario


class Vo2Support:
    """`PlantSupport` of the VO2 actuator."""

    estimators: Mapping[str, Callable[[Vo2Model], Estimator]] = ESTIMATORS

    def read_model(self, path: Path) -> Vo2Model:
        """What `rtctl identify` has written."""
        return read_model(path)

    def identity(self, model: Vo2Model) -> str:
        """Of the device on which the model was identified."""
        return model.identity

    def unused(self, model: Vo2Model) -> tuple[str, ...]:
        """What a diagnosis has added: they use the identified loops and time constant as they are."""
        return (*(mechanism.id for mechanism in model.mechanisms), *model.corrections)

    def output_range(self, scenario: Scenario, model: Vo2Model) -> Span:
        """Deflections that were seen at identification [um]."""
        return model.deflection

    def reading_at_rest(self, model: Vo2Model) -> tuple[float, ...]:
        """The cold film's resistance."""
        return (model.resistance.high,)

    def limits(self, scenario: Scenario, model: Vo2Model) -> tuple[CommandLimits, ...]:
        """No wider than where more current means more deflection."""
        return (current_limits(scenario, controllable(model)),)

    def control(self, scenario: Scenario, model: Vo2Model, delay: int) -> Control:
        """PI with gains from the steepest slope of the identified deflection."""
        return Control(*build_controller(scenario, model, controllable(model), delay))

    def predict(self, model: Vo2Model, level: Mapping[str, float]) -> dict[str, float]:
        """Nothing: the deflection at a current depends on its history."""
        return {}


def controllable(model: Vo2Model) -> WorkingRange:
    """Where the model can be controlled. Raises InputError where nowhere."""
    try:
        return working_range(model.deflection_preisach, model.current)
    except ValueError as error:
        raise InputError(f"the model cannot be controlled: {error}") from None


def current_limits(scenario: Scenario, working: WorkingRange) -> CommandLimits:
    """`[limits]`, no wider than the working range. Raises InputError where the two contradict."""
    table = scenario.limits
    low, high = max(table.low, working.current.low), min(table.high, working.current.high)
    if not low < high:
        raise InputError(
            f"limits.low = {table.low:g} mA and limits.high = {table.high:g} mA leave nothing of the range "
            f"{working.current.low:g} to {working.current.high:g} mA in which the model can be controlled"
        )
    if table.safe_level > high:
        raise InputError(
            f"limits.safe = {table.safe_level:g} mA lies above {high:g} mA, where the model's controllable range "
            "ends; lower it"
        )
    return replace(table.command_limits(), low=low, high=high)


def build_controller(
    scenario: Scenario, model: Vo2Model, working: WorkingRange, delay: int
) -> tuple[PiController, Tuning]:
    """The controller of `[controller]` with gains from the model, or hand-set ones with their margins."""
    table = scenario.controller
    if not isinstance(table, PiTable):
        raise InputError(f'controller.kind = "{table.kind}" does not control a "vo2"; use "pi"')
    plant = {
        "plant_gain": working.steepest_slope,
        "time_constant_s": model.time_constant_s,
        "period_s": scenario.scenario.period_s,
    }
    if table.kp is not None and table.ki is not None:
        tuning = margins(PiGains(kp=table.kp, ki=table.ki), **plant, delay=delay)
    else:
        least_phase_deg = math.degrees(table.phase_margin_rad)
        tuning = tune(
            **plant, delay=delay, least_gain_margin=table.gain_margin, least_phase_margin_deg=least_phase_deg
        )
        if tuning.gain_margin < table.gain_margin or tuning.phase_margin_deg < least_phase_deg:
            raise InputError(
                f"controller.gain_margin = {table.gain_margin:g} and controller.phase_margin = {least_phase_deg:.3g} "
                f"deg are out of a PI's reach: the slowest one tried leaves {tuning.gain_margin:.3g} and "
                f"{tuning.phase_margin_deg:.3g} deg; ask for less, or give kp and ki"
            )
    deadband = table.deadband.resolve_width(0.0, model.deflection.width)
    feedforward = _feedforward(table, scenario, model, working)
    return PiController(tuning.gains, feedforward, deadband=deadband), tuning


def _feedforward(table: PiTable, scenario: Scenario, model: Vo2Model, working: WorkingRange) -> Feedforward:
    if table.feedforward == "none":
        return NoFeedforward()
    limits = current_limits(scenario, working)
    return InverseFeedforward(model, Span(limits.low, limits.high))
