"""The VO2 actuator: a current through a film that senses itself, deflection controlled by a PI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.controllers.extended_feedforward import ExtendedFeedforward
from rtctl.controllers.extended_tuning import extended_margins, tune_extended
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.linear_loop import LinearLoop, linear_loop
from rtctl.controllers.pi import Feedforward, NoFeedforward, PiController, PiGains
from rtctl.controllers.tuning import Tuning, margins, tune
from rtctl.estimators import ESTIMATORS
from rtctl.interfaces import Estimator
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model, read_model
from rtctl.models.working_range import WorkingRange, working_range
from rtctl.plant_control.support import Control
from rtctl.plants.vo2.tables import PiTable
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario
from rtctl.simulations.vo2.loop_dynamics import LEFT_OUT, NOT_TRUSTED, Vo2Dynamics, loop_dynamics


class Vo2Support:
    """`PlantSupport` of the VO2 actuator."""

    estimators: Mapping[str, Callable[[Vo2Model], Estimator]] = ESTIMATORS

    def read_model(self, path: Path) -> Vo2Model:
        """Read the model file that `rtctl identify` has written."""
        return read_model(path)

    def identity(self, model: Vo2Model) -> str:
        """Return the identity of the device on which the model was identified."""
        return model.identity

    def unused(self, model: Vo2Model) -> tuple[str, ...]:
        """Mechanisms without a place in the loop, and why."""
        return tuple(
            f"{one} ({(LEFT_OUT | NOT_TRUSTED).get(one, 'at neutral')})"
            for one in loop_dynamics(model).left_out
        )

    def output_range(self, scenario: Scenario, model: Vo2Model) -> Span:
        """Deflections that were seen at identification [um]."""
        return model.deflection

    def reading_at_rest(self, model: Vo2Model) -> tuple[float, ...]:
        """Return the cold film's resistance [ohm]."""
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
    """Commands between which the model can be controlled. Raises InputError where nowhere."""
    try:
        working = working_range(model.deflection_preisach, model.current)
    except ValueError as error:
        raise InputError(f"the model cannot be controlled: {error}") from None
    dynamics = loop_dynamics(model)
    if dynamics.is_plain:
        return working
    low, high = (max(dynamics.current.back(end), 0.0) for end in working.current)
    slope = working.steepest_slope * abs(dynamics.deflection.gain * dynamics.current.gain)
    return WorkingRange(Span(low, high), working.deflection, slope)


LAG_AS_DEAD_TIME = 1.2
"""Dead time over the lag of a transition that it stands for, in tuning and feedforward: the best on two devices."""


def controlled(model: Vo2Model) -> Vo2Dynamics:
    """Return the dynamics that tuning and feedforward use: a transition that lags is a dead time.

    At a reversal the temperature has to cross the hysteresis at once. Of a lagging transition an inverse would ask for
    several times that, which limits cut off, and PI and feedforward then work against each other.
    """
    found = loop_dynamics(model)
    lag_s = found.balance.lag_s
    if lag_s == 0.0:
        return found
    at_once = found.balance._replace(lag_s=0.0)
    phases = found.phases._replace(activation=0.0, mixing=0.0)
    return replace(
        found, balance=at_once, phases=phases, expansion=0.0, delay_s=found.delay_s + LAG_AS_DEAD_TIME * lag_s
    )


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
    """Return the controller of `[controller]` with gains from the model, or hand-set ones, and their margins."""
    table = scenario.controller
    if not isinstance(table, PiTable):
        raise InputError(f'controller.kind = "{table.kind}" does not control a "vo2"; use "pi"')
    dynamics = controlled(model)
    if table.kp is not None and table.ki is not None:
        gains = PiGains(kp=table.kp, ki=table.ki)
        tuning = _given(gains, scenario, model, dynamics, working, delay)
    else:
        least_phase_deg = math.degrees(table.phase_margin_rad)
        tuning = _tuned(table, scenario, model, dynamics, working, delay)
        short = tuning.gain_margin < table.gain_margin or tuning.phase_margin_deg < least_phase_deg
        if short and not tuning.kept_gains:
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
    command, dynamics = Span(limits.low, limits.high), controlled(model)
    if dynamics.is_plain:
        return InverseFeedforward(model, command)
    return ExtendedFeedforward(model, dynamics, command)


def _given(
    gains: PiGains, scenario: Scenario, model: Vo2Model, dynamics: Vo2Dynamics, working: WorkingRange, delay: int
) -> Tuning:  # fmt: skip
    """Margins of hand-set gains."""
    gain, period_s = working.steepest_slope, scenario.scenario.period_s
    if dynamics.is_plain:
        tau_s = model.time_constant_s
        return margins(gains, plant_gain=gain, time_constant_s=tau_s, period_s=period_s, delay=delay)
    loop = _linear(model, dynamics, working)
    found = extended_margins(gains, loop, plant_gain=gain, period_s=period_s, delay=delay)
    return replace(found, notes=dynamics.used)


def _tuned(
    table: PiTable, scenario: Scenario, model: Vo2Model, dynamics: Vo2Dynamics, working: WorkingRange, delay: int
) -> Tuning:  # fmt: skip
    """Return the fastest PI that keeps the margins of `[controller]`, or the gains without the model's mechanisms."""
    least = {
        "least_gain_margin": table.gain_margin,
        "least_phase_margin_deg": math.degrees(table.phase_margin_rad),
    }
    gain, period_s = working.steepest_slope, scenario.scenario.period_s
    tau_s = model.time_constant_s
    plain = tune(plant_gain=gain, time_constant_s=tau_s, period_s=period_s, delay=delay, **least)
    if dynamics.is_plain:
        return plain
    loop = _linear(model, dynamics, working)
    found = tune_extended(loop, plant_gain=gain, period_s=period_s, delay=delay, before=plain.gains, **least)
    return replace(found, notes=dynamics.used)


def _linear(model: Vo2Model, dynamics: Vo2Dynamics, working: WorkingRange) -> LinearLoop:
    """Around the middle of the working range, where the film switches."""
    current = dynamics.current.of(0.5 * (working.current.low + working.current.high))
    heating = max(current - dynamics.balance.zone, 0.0)
    stroke = float(model.deflection_preisach.nodes[-1, 0])
    return linear_loop(
        dynamics, heating * heating, working.steepest_slope / max(2.0 * heating * stroke, 1e-9)
    )
