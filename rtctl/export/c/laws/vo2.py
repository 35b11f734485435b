"""The exported law of a VO2 actuator: its constants and its memory, by model and scenario."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any

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
from rtctl.export.c.laws.law import Corners, Law, input_record, output_record
from rtctl.export.c.laws.loop_memory import Parts, Rules, loop_memory, refuse_stops
from rtctl.export.c.laws.observer import observer_part
from rtctl.export.c.laws.parts import Part, Rest
from rtctl.export.c.laws.sample import pi_control, sample_of
from rtctl.models.vo2 import Vo2Model
from rtctl.translation.memory import Memory

ESTIMATORS: dict[type, Callable[[Vo2Model, Rest], Part]] = {
    ObserverEstimator: observer_part,
    CompositeEstimator: composite_part,
    GapFreeEstimator: gap_free_part,
    DirectEgpiEstimator: direct_egpi_part,
    DirectPreisachEstimator: direct_preisach_part,
}
"""What can be exported of a model alone, by the class that the loop in Python uses."""


CORNERS = Corners((3.0e3, 2.0e5), (-20.0, 90.0))


def vo2_law(model: Vo2Model, parts: Parts, extrema: int) -> Law:
    """Return the law of a loop.

    Args:
        model: the identified model.
        parts: the loop's parts.
        extrema: turning points that a Preisach memory keeps; beyond them the innermost loop is forgotten.

    Raises:
        InputError: a part cannot be exported.
    """
    controller, limits = parts.controller, parts.limits[0]
    if type(controller) is not PiController:
        raise InputError(f"export c: the controller is a {type(controller).__name__}; a PI can be exported")
    refuse_stops(parts.limits)
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
    gains = controller.gains
    control = np.array(
        [0.0, 0.0, gains.kp, gains.ki, controller.deadband, limits.low, limits.high, limits.slew_per_s]
    )
    return Law(
        name=used[0].name,
        sample=sample_of(
            used[0].function,
            pi_control(used[1].function if len(used) > 1 else None),
            parts.delay,
            swings=used[0].swings,
        ),
        constants=made,
        memory=(
            *loop_memory(parts),
            Memory("control", control, "integral, error, kp, ki, deadband, low, high, slew"),
            *(entry for part in used for entry in part.memory),
        ),
        input=input_record(parts.profile),
        output=output_record(parts.profile, parts.estimator.surrogate, controller.terms),
        corners=CORNERS,
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
