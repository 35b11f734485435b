"""The exported law of a VO2 actuator: its constants and its memory, by model and scenario."""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.controllers.extended_feedforward import ExtendedFeedforward
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import NoFeedforward, PiController
from rtctl.estimators.composite import CompositeEstimator
from rtctl.estimators.corrected import CorrectedEstimator
from rtctl.estimators.direct import DirectEgpiEstimator, DirectPreisachEstimator
from rtctl.estimators.extended_observer import ExtendedObserver
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.estimators.observer import ObserverEstimator
from rtctl.export.c.laws.composites import (
    composite_part,
    direct_egpi_part,
    direct_preisach_part,
    gap_free_part,
)
from rtctl.export.c.laws.extended import (
    corrected_part,
    extended_feedforward_part,
    extended_observer_part,
)
from rtctl.export.c.laws.feedforward import feedforward_part
from rtctl.export.c.laws.law import Law, Memory
from rtctl.export.c.laws.observer import observer_part
from rtctl.export.c.laws.parts import Part, Rest
from rtctl.export.c.laws.sample import sample_of
from rtctl.models.vo2 import Vo2Model
from rtctl.safety.guards import ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility

NO_RULES = ReadingRules(names=("",), rates=(math.inf,))


ESTIMATORS: dict[type, Callable[[Vo2Model, Rest], Part]] = {
    ObserverEstimator: observer_part,
    CompositeEstimator: composite_part,
    GapFreeEstimator: gap_free_part,
    DirectEgpiEstimator: direct_egpi_part,
    DirectPreisachEstimator: direct_preisach_part,
}
"""What can be exported of a model alone, by the class that the loop in Python uses."""


class Rules(NamedTuple):
    """Times and levels of the loop."""

    period_s: float
    """Sample period [s]."""
    safe: float
    """The level at which the device is at rest [mA]."""


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
    rest = Rest(limits.safe, extrema, parts.period_s)
    used = [estimator_part(parts.estimator, model, rest)]
    forward = controller.feedforward
    if isinstance(forward, InverseFeedforward):
        used.append(feedforward_part(forward, model, rest))
    elif isinstance(forward, ExtendedFeedforward):
        used.append(extended_feedforward_part(forward, rest))
    elif not isinstance(forward, NoFeedforward):
        raise InputError(f"export c: the feedforward is a {type(forward).__name__}, which has no form in C")
    constants: dict[str, Any] = {"rules": Rules(parts.period_s, limits.safe)}
    sources = {"rules.period_s": "scenario.period", "rules.safe": "limits.safe"}
    for part in used:
        constants |= part.constants
        sources |= part.sources
    made = namedtuple("Constants", constants)(**constants)
    return Law(
        name=used[0].name,
        sample=sample_of(
            used[0].function,
            used[1].function if len(used) > 1 else None,
            parts.delay,
            swings=used[0].swings,
        ),
        constants=made,
        memory=(*_loop_memory(parts), *(entry for part in used for entry in part.memory)),
        sources=sources,
        settle_steps=parts.settle_steps,
    )


def estimator_part(estimator: Any, model: Vo2Model, rest: Rest) -> Part:
    """Return an estimator as a part, at rest. Raises InputError for one that has no form in C."""
    if isinstance(estimator, ExtendedObserver):
        return extended_observer_part(estimator, rest)
    if isinstance(estimator, CorrectedEstimator):
        return corrected_part(estimator_part(estimator.inner, model, rest), estimator.params, rest)
    make = ESTIMATORS.get(type(estimator))
    if make is None:
        known = ", ".join(kind.__name__ for kind in ESTIMATORS)
        raise InputError(
            f"export c: the estimator cannot be exported: {type(estimator).__name__} is none of {known}"
        )
    return make(model, rest)


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
