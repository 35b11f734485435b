"""The exported law of a resonator: amplitude by the coil's current, phase by the frequency, from a lock-in."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rtctl.border.errors import InputError
from rtctl.controllers.agc_pll import AgcPllController, AgcPllMemory, AgcPllParams
from rtctl.estimators.lock_in import LockInEstimator, LockInMemory
from rtctl.export.c.laws.law import Corners, Law, input_record, output_record
from rtctl.export.c.laws.loop_memory import Limits, Parts, Rules, limits_of, loop_memory, refuse_stops
from rtctl.export.c.laws.resonator_sample import resonator_sample_of
from rtctl.models.resonator import ResonatorModel, ResonatorParams
from rtctl.translation.memory import Memory

CORNERS = Corners((-1.8, 1.8), (-0.2, 1.6))
PLACES = {
    "damping": "damping", "damping_squared": "damping.nonlinear", "damping_quadratic": "damping.quadratic",
    "friction": "friction.coulomb", "resonance": "root of model.parameters.stiffness", "decay": "half of damping",
    "growth": "of drive_gain and stiffness", "delay_s": "drive.delay", "drive_lag_s": "drive.lag",
    "sensor_lag_s": "sensor.lag",
}  # fmt: skip


class ResonatorConstants(NamedTuple):
    """Constants of the law."""

    rules: Rules
    safe_hz: float
    current: Limits
    frequency: Limits
    resonator: ResonatorParams
    loops: AgcPllParams


def resonator_law(model: ResonatorModel, parts: Parts) -> Law:
    """Return the law of a resonator's loop. Raises InputError where a part has no form in C."""
    controller, estimator = parts.controller, parts.estimator
    if type(controller) is not AgcPllController or type(estimator) is not LockInEstimator:
        raise InputError(
            f"export c: of a resonator the estimator lock_in and the controller agc_pll can be exported, these are "
            f"{type(estimator).__name__} and {type(controller).__name__}"
        )
    if model.sensor_curvature > 0.0:
        raise InputError(
            "export c: sensor.saturation of the model has no form in C: its describing function is a quadrature; "
            "export the model without it"
        )
    refuse_stops(parts.limits)
    current, frequency = parts.limits
    if math.isfinite(frequency.rms):
        raise InputError(
            f"export c: limits.{parts.profile.commands[1].name}.rms has no place in the exported loop"
        )
    constants = ResonatorConstants(
        Rules(parts.period_s, current.safe), frequency.safe, limits_of(current), limits_of(frequency), controller.model,
        controller.params,
    )  # fmt: skip
    return Law(
        name="lock_in",
        sample=resonator_sample_of(parts.delay),
        constants=constants,
        memory=(
            *loop_memory(parts),
            *_memory(LockInMemory(), "lock-in"),
            *_memory(AgcPllMemory(), "amplitude and phase loop"),
        ),
        input=input_record(parts.profile),
        output=output_record(parts.profile, estimator.surrogate, controller.terms),
        corners=CORNERS,
        sources={
            "rules.period_s": "scenario.period",
            "rules.safe": "limits.safe",
            **{f"resonator.{name}": f"model: {place}" for name, place in PLACES.items()},
            "loops": "controller, tuned on the model",
        },
        settle_steps=parts.settle_steps,
    )


def _memory(start: Any, owner: str) -> list[Memory]:
    return [Memory(name, getattr(start, name), f"of the {owner}") for name in start.__slots__]
