"""The exported law of a VO2 actuator: its constants and its memory, by model and scenario."""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import NoFeedforward, PiController
from rtctl.estimators.observer import PROBE_MA2, ObserverEstimator, filter_start, observer_params
from rtctl.export.c.laws.feedforward import feedforward
from rtctl.export.c.laws.law import Law, Memory
from rtctl.export.c.laws.observer import observer
from rtctl.export.c.laws.sample import sample_of
from rtctl.hysteresis.preisach.model import MAX_EXTREMA
from rtctl.models.vo2 import Vo2Model
from rtctl.safety.guards import ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility

NO_RULES = ReadingRules(names=("",), rates=(math.inf,))


class Rules(NamedTuple):
    """Times and levels of the loop."""

    period_s: float
    """Sample period [s]."""
    safe: float
    """The level at which the device is at rest [mA]."""


class Fit(NamedTuple):
    """Quality of the identified model."""

    error: float
    """Standard deviation of the deflection model on its data [um]."""


class Parts(NamedTuple):
    """The parts of a loop that is exported."""

    estimator: Any
    controller: Any
    limits: CommandLimits
    plausibility: Plausibility
    guard: ReadingGuard | None
    period_s: float
    settle_steps: int
    delay: int


def vo2_law(model: Vo2Model, parts: Parts, extrema: int) -> Law:
    """Return the law of a loop.

    Args:
        model: the identified model.
        parts: the loop's parts.
        extrema: turning points that a Preisach memory keeps; beyond them the innermost loop is forgotten.

    Raises:
        InputError: a part cannot be exported.
    """
    controller, limits = parts.controller, parts.limits
    if type(controller) is not PiController:
        raise InputError(f"export c: the controller is a {type(controller).__name__}; a PI can be exported")
    if limits.stop:
        raise InputError(
            "export c: limits.stop = true cannot be exported: the exported loop limits, it does not stop"
        )
    forward = controller.feedforward
    if type(forward) not in (NoFeedforward, InverseFeedforward):
        raise InputError(
            f"export c: the feedforward is a {type(forward).__name__}, of a model with mechanisms; "
            'set controller.feedforward = "none", or export the nominal model'
        )
    if type(parts.estimator) is not ObserverEstimator:
        raise InputError(
            f"export c: the estimator is a {type(parts.estimator).__name__}, which cannot be exported"
        )
    safe = limits.safe
    constants: dict[str, Any] = {"rules": Rules(parts.period_s, safe), "fit": Fit(model.deflection_error)}
    resistance, deflection = model.resistance_preisach, model.deflection_preisach
    params = observer_params(model)
    constants |= {"observer": params, "resistance": resistance.params, "deflection": deflection.params}
    start = safe * safe
    memory = [
        *_loop_memory(parts),
        Memory("filter", filter_start(params, start), "s, probed s, b, m, P_bb, P_bm, P_mm"),
        Memory("resistance_stack", shortened(resistance.initial_state(safe), extrema), "k, s_0 ..., H_0 ..."),
        Memory("probed_stack", shortened(resistance.initial_state(math.sqrt(start + PROBE_MA2)), extrema)),
        Memory("deflection_stack", shortened(deflection.initial_state(safe), extrema)),
    ]
    if isinstance(forward, InverseFeedforward):
        constants["inverse"] = forward.params
        stack = shortened(deflection.initial_state(safe), extrema)
        memory.append(Memory("feedforward", np.concatenate(([start], stack)), "s [mA^2], then its stack"))
    made = namedtuple("Constants", constants)(**constants)  # type: ignore[misc]
    return Law(
        name="observer",
        sample=sample_of(observer, feedforward if "inverse" in constants else None, parts.delay),
        constants=made,
        memory=tuple(memory),
        settle_steps=parts.settle_steps,
    )


def shortened(stack: FloatArray, extrema: int) -> FloatArray:
    """Return a Preisach memory with room for fewer turning points."""
    return np.concatenate(
        (stack[:1], stack[1 : 1 + extrema], stack[1 + MAX_EXTREMA : 1 + MAX_EXTREMA + extrema])
    )


def _loop_memory(parts: Parts) -> list[Memory]:
    """Return the memory of limits, controller and guards, the rules of the latter in it."""
    limits, controller, guard = parts.limits, parts.controller, parts.guard
    gains = controller.gains
    control = np.array(
        [0.0, 0.0, gains.kp, gains.ki, controller.deadband, limits.low, limits.high, limits.slew_per_s]
    )
    memory = [
        Memory("known", 0, "1: there is a reading before"),
        Memory("settle_left", parts.settle_steps + 1, "readings at the safe level before the loop closes"),
        Memory("fault", 0, "the first fault; 0: none"),
        Memory("level", limits.safe, "the level that was commanded last [mA]"),
        Memory("sent", np.full(parts.delay + 1, limits.safe), "the levels before it, the oldest first [mA]"),
        Memory("control", control, "integral, error, kp, ki, deadband, low, high, slew"),
        Memory("mean_square", limits.safe * limits.safe, "of the command [mA^2]"),
        Memory(
            "rms_squared",
            limits.rms * limits.rms if math.isfinite(limits.rms) else math.inf,
            "its limit [mA^2]",
        ),
        Memory("rms_window_s", limits.rms_window_s, "time constant of the mean [s]"),
        Memory("sensed", 0.0, "the reading before [ohm]"),
        Memory("counter", np.int64(0), "its sample counter"),
        Memory("time_us", np.int64(0), "its time on the device's clock [us]"),
        Memory("begun_ns", np.int64(0), "the request of this reading [ns]"),
        Memory("answered_ns", np.int64(0), "and its answer [ns]"),
        Memory("elapsed_s", 0.0, "time since the reading before [s]"),
        Memory("sensed_low", parts.plausibility.sensed_low[0], "plausible readings [ohm]"),
        Memory("sensed_high", parts.plausibility.sensed_high[0]),
        Memory("guarded", 0 if guard is None else 1, "1: readings are held to those before them"),
        Memory(
            "rate", math.inf if guard is None else guard.rules.rates[0], "largest change of a reading [ohm/s]"
        ),
    ]
    found = (guard or ReadingGuard(NO_RULES)).memory
    for name in found.dtype.names or ():
        value = found[name][0]
        memory.append(Memory(name, np.int64(value) if found.dtype[name].kind == "i" else float(value)))
    return memory
