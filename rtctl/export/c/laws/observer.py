"""The thermal observer as an exported estimator."""

from __future__ import annotations

import math
from typing import Any

from rtctl.arithmetic.standard_error import combined
from rtctl.estimators.observer import PROBE_MA2, filter_start, observer_params, observer_step
from rtctl.export.c.laws.parts import Fit, Part, Rest, preisach_sources, shortened
from rtctl.models.vo2 import Vo2Model
from rtctl.translation.memory import Memory

READING = "model.parameters.reading_error"
SOURCES = {
    "fit.error": "model.parameters.deflection_error",
    "observer.time_constant_s": "model.parameters.thermal_time_constant",
    "observer.reading_variance": f"of {READING}: rtctl.estimators.observer.observer_params",
    "observer.model_variance": f"of {READING}",
    "observer.error_length": "of model.parameters.current_low, current_high",
    "observer.low": "model.parameters.current_low, less 2 %",
    "observer.high": "model.parameters.current_high, and 2 %",
    "observer.heat_faked": f"of {READING} and the steepest slope of -ln R",
    **preisach_sources("resistance", "resistance_preisach"),
    **preisach_sources("deflection", "deflection_preisach"),
}


def observer(
    s: Any, c: Any, level: float, sensed: float, elapsed_s: float
) -> tuple[float, float, float, int]:
    """Return deflection [um], surrogate [mA], standard error [um] and status bits."""
    value, surrogate, error, status = observer_step(
        s.filter, s.resistance_stack, s.probed_stack, s.deflection_stack, level, sensed, elapsed_s,
        c.observer, c.resistance, c.deflection,
    )  # fmt: skip
    return value, surrogate, combined(error, c.fit.error), status


def observer_part(model: Vo2Model, rest: Rest) -> Part:
    """Return the observer of a model, at rest at a level."""
    power = rest.level * rest.level
    params, resistance, deflection = (
        observer_params(model),
        model.resistance_preisach,
        model.deflection_preisach,
    )
    probed = resistance.initial_state(math.sqrt(power + PROBE_MA2))
    stack = "extrema of H: k, s_0 ... [mA], H_0 ... [ln ohm]"
    return Part(
        name="observer",
        function=observer,
        constants={
            "fit": Fit(model.deflection_error, 0.0), "observer": params,
            "resistance": resistance.params, "deflection": deflection.params,
        },
        memory=(
            Memory("filter", filter_start(params, power), "s, probed s, b, m, P_bb, P_bm, P_mm, H"),
            Memory("resistance_stack", shortened(resistance.initial_state(rest.level), rest.extrema), stack),
            Memory("probed_stack", shortened(probed, rest.extrema), "the same, a little warmer"),
            Memory("deflection_stack", shortened(deflection.initial_state(rest.level), rest.extrema), "extrema of D"),
        ),
        sources=SOURCES,
    )  # fmt: skip
