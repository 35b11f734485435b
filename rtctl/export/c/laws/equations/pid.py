"""The exported law of a PID on the controlled output of a user's equations, which is read or estimated."""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

from rtctl.border.equations.controlled import StateSpace
from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidController, PidMemory
from rtctl.estimators.cubature import CubatureFilter
from rtctl.estimators.reading import ReadingEstimator
from rtctl.export.c.laws.equations.kalman import kalman_part
from rtctl.export.c.laws.law import Corners, Law, input_record, output_record
from rtctl.export.c.laws.loop_memory import Parts, Rules, limits_of, loop_memory, refuse_stops
from rtctl.export.c.laws.parts import Part
from rtctl.export.c.laws.sample import pid_control, sample_of
from rtctl.translation.memory import Memory

WIDEST = 1e3
"""Readings that a proof tries where the scenario has no plausible range, in their unit."""


class Reading(NamedTuple):
    """The reading that is the controlled output."""

    factor: float
    """Output's units of the reading's unit."""


def reading(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> tuple[float, float, float, int]:
    """Return the reading in the output's unit, nothing beside it, no standard error, status bits 0."""
    return c.reading.factor * sensed, math.nan, math.nan, 0


def pid_law(model: StateSpace, parts: Parts) -> Law:
    """Return the law of a PID's loop. Raises InputError where a part has no form in C."""
    controller, profile = parts.controller, parts.profile
    assert isinstance(controller, PidController)
    if len(profile.commands) != 1 or len(profile.sensed) != 1:
        raise InputError(
            f"export c: a PID of one command and one reading can be exported, this device has "
            f"{len(profile.commands)} and {len(profile.sensed)}"
        )
    refuse_stops(parts.limits)
    used = estimator_part(model, parts)
    low, high = parts.plausibility.sensed_low[0], parts.plausibility.sensed_high[0]
    tried = (low if math.isfinite(low) else -WIDEST, high if math.isfinite(high) else WIDEST)
    wanted = model.output_range or tried
    if isinstance(parts.estimator, ReadingEstimator):
        wanted = (parts.estimator.factor * tried[0], parts.estimator.factor * tried[1])
    constants: dict[str, Any] = {
        "rules": Rules(parts.period_s, parts.limits[0].safe), "limits": limits_of(parts.limits[0]),
        **used.constants, "pid": controller.params,
    }  # fmt: skip
    start = PidMemory()
    return Law(
        name=used.name,
        sample=sample_of(used.function, pid_control(), parts.delay),
        constants=namedtuple("PidConstants", constants)(**constants),
        memory=(
            *loop_memory(parts),
            *used.memory,
            *(Memory(name, getattr(start, name), "of the PID") for name in start.__slots__),
        ),
        input=input_record(profile),
        output=output_record(profile, parts.estimator.surrogate, controller.terms),
        corners=Corners(tried, wanted),
        sources={
            "rules.period_s": "scenario.period",
            "rules.safe": "limits.safe",
            "limits": "limits of the scenario",
            "pid": "controller, by hand or tuned on the model",
            **used.sources,
        },
        settle_steps=parts.settle_steps,
    )  # fmt: skip


def estimator_part(model: StateSpace, parts: Parts) -> Part:
    """Return the estimator. Raises InputError where it has no form in C."""
    estimator = parts.estimator
    if type(estimator) is CubatureFilter:
        levels = tuple(one.safe for one in parts.limits)
        return kalman_part(model, estimator, levels)
    if type(estimator) is ReadingEstimator and estimator.index >= 0:
        factor = Reading(float(estimator.factor))
        return Part(name="none", function=reading, constants={"reading": factor}, memory=())
    raise InputError(
        "export c: beside a PID the estimators none, which takes a reading for the controlled output, and kalman can "
        f"be exported; this is a {type(estimator).__name__}"
        + ("" if type(estimator) is not ReadingEstimator else " without a reading in the output's unit")
    )
