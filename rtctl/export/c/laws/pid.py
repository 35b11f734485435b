"""The exported law of a PID on a reading of the controlled output."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidController, PidMemory, PidParams
from rtctl.estimators.reading import ReadingEstimator
from rtctl.export.c.laws.law import Corners, Law, Memory, input_record, output_record
from rtctl.export.c.laws.loop_memory import Limits, Parts, Rules, limits_of, loop_memory, refuse_stops
from rtctl.export.c.laws.sample import pid_control, sample_of

WIDEST = 1e3
"""Readings that a proof tries where the scenario has no plausible range, in their unit."""


class Reading(NamedTuple):
    """The reading that is the controlled output."""

    factor: float
    """Output's units of the reading's unit."""


class PidConstants(NamedTuple):
    """Constants of the law."""

    rules: Rules
    limits: Limits
    reading: Reading
    pid: PidParams


def reading(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> tuple[float, float, float, int]:
    """Return the reading in the output's unit, nothing beside it, no standard error, status bits 0."""
    return c.reading.factor * sensed, math.nan, math.nan, 0


def pid_law(parts: Parts) -> Law:
    """Return the law of a PID's loop. Raises InputError where a part has no form in C."""
    controller, estimator, profile = parts.controller, parts.estimator, parts.profile
    assert isinstance(controller, PidController)
    if type(estimator) is not ReadingEstimator or estimator.index < 0:
        raise InputError(
            f"export c: beside a PID the estimator none can be exported, which takes a reading for the controlled "
            f"output; this is a {type(estimator).__name__}"
            + ("" if type(estimator) is not ReadingEstimator else " without a reading in the output's unit")
        )
    if len(profile.commands) != 1 or len(profile.sensed) != 1:
        raise InputError(
            f"export c: a PID of one command and one reading can be exported, this device has "
            f"{len(profile.commands)} and {len(profile.sensed)}"
        )
    refuse_stops(parts.limits)
    low, high = parts.plausibility.sensed_low[0], parts.plausibility.sensed_high[0]
    tried = (low if math.isfinite(low) else -WIDEST, high if math.isfinite(high) else WIDEST)
    wanted = (estimator.factor * tried[0], estimator.factor * tried[1])
    start = PidMemory()
    return Law(
        name="none",
        sample=sample_of(reading, pid_control(), parts.delay),
        constants=PidConstants(
            Rules(parts.period_s, parts.limits[0].safe), limits_of(parts.limits[0]),
            Reading(float(estimator.factor)), controller.params,
        ),
        memory=(
            *loop_memory(parts),
            *(Memory(name, getattr(start, name), "of the PID") for name in start.__slots__),
        ),
        input=input_record(profile),
        output=output_record(profile, estimator.surrogate, controller.terms),
        corners=Corners(tried, wanted),
        sources={
            "rules.period_s": "scenario.period",
            "rules.safe": "limits.safe",
            "limits": "limits of the scenario",
            "pid": "controller, by hand or tuned on the model",
        },
        settle_steps=parts.settle_steps,
    )  # fmt: skip
