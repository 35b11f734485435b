"""Parameters that a refit of the nominal model may move: the time constant, gain and offset of every signal.

Gains pivot on the middle of the range at identification, which decouples gain and offset:
x' = x + (gain - 1) (x - middle) + offset, x a current [mA], -ln R, or a deflection [um].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Parameter, Scales
from rtctl.border.simulation import FreeParameter
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.mechanism import Values

TIME_CONSTANT = Parameter(
    name="time_constant",
    unit="s",
    meaning="of the heating",
    scale=lambda s: s.response_s or 1e-3,
    low=1e-6,
    high=1e3,
)


AT_REST = ("heater.tcr", "thermal.nonlinear_loss")
"""Mechanisms that change how far a current heats at rest, as a gain and an offset of the current do."""


OF_READING = ("sensor.crosstalk", "sensor.ageing")
"""Mechanisms that change what the resistance reads at rest, as a gain and an offset of it do."""


def _gain(of: str, **more: Any) -> Parameter:
    return Parameter(
        name=f"{of}_gain", unit="dimensionless", meaning=f"of the {of} about the middle of its range",
        scale=lambda s: 0.1, neutral=1.0, default=1.0, low=0.2, high=5.0, **more,
    )  # fmt: skip


def _offset(of: str, unit: str, scale: Callable[[Scales], float], what: str = "", **more: Any) -> Parameter:
    return Parameter(
        name=f"{of}_offset",
        unit=unit,
        meaning=f"added to the {what or of}",
        scale=scale,
        default=0.0,
        **more,
    )


NOMINAL_PARAMETERS = (
    TIME_CONSTANT,
    _gain("current", imitates=AT_REST),
    _offset(
        "current",
        "mA",
        lambda s: 0.005 * s.drive,
        opposite="actuation.deadband",
        imitates=AT_REST,
    ),
    _gain("resistance", imitates=OF_READING),
    _offset("resistance", "dimensionless", lambda s: 0.1, "logarithm of the resistance", imitates=OF_READING),
    _gain("deflection"),
    _offset("deflection", "um", lambda s: 0.02 * s.displacement),
)
CORRECTIONS = {declared.name: declared for declared in NOMINAL_PARAMETERS[1:]}


def nominal_parameters(model: Vo2Model) -> list[FreeParameter]:
    """Return the parameters of an identified model, with the corrections in its file."""
    found = []
    for declared in NOMINAL_PARAMETERS:
        value, fixed = model.time_constant_s, False
        if declared is not TIME_CONSTANT:
            given = model.corrections.get(declared.name)
            value = given.to(declared.unit) if given else float(declared.default or 0.0)
            fixed = given.fixed if given else False
        found.append(
            FreeParameter(
                declared.name, declared.unit, value, declared.low, declared.high, fixed, declared, ""
            )
        )
    return found


def corrected(x: FloatArray, signal: str, middle: float, values: Values, sign: float = 1.0) -> FloatArray:
    """Return x' of one signal; `x` itself without a correction. `sign` -1: x is minus the quantity of the offset."""
    gain, offset = values[f"{signal}_gain"], values[f"{signal}_offset"]
    if gain == 1.0 and offset == 0.0:
        return x
    return x + (gain - 1.0) * (x - middle) + sign * offset


def middle(span: Span) -> float:
    """Return the middle of a range."""
    return 0.5 * (span.low + span.high)


def middle_reading(span: Span) -> float:
    """Return the middle of -ln R over a range of resistances."""
    return -0.5 * (math.log(span.low) + math.log(span.high))
