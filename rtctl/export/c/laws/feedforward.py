"""The feedforward through the inverse of the model, as an exported part."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.controllers.feedforward import InverseFeedforward, inverse_step
from rtctl.export.c.laws.parts import Part, Rest, preisach_sources, shortened
from rtctl.models.vo2 import Vo2Model
from rtctl.translation.memory import Memory


def feedforward(s: Any, c: Any, upcoming: float, elapsed_s: float) -> float:
    """Return the command [mA] that brings the model's deflection to `upcoming` [um] in one period."""
    return inverse_step(s.feedforward, upcoming, elapsed_s, c.inverse, c.deflection)


def feedforward_part(forward: InverseFeedforward, model: Vo2Model, rest: Rest) -> Part:
    """Return the feedforward, at rest at a level."""
    stack = shortened(model.deflection_preisach.initial_state(rest.level), rest.extrema)
    return Part(
        name="feedforward",
        function=feedforward,
        constants={"inverse": forward.params, "deflection": model.deflection_preisach.params},
        memory=(
            Memory(
                "feedforward",
                np.concatenate(([rest.level * rest.level], stack)),
                "s [mA^2], then extrema of D",
            ),
        ),
        sources={
            "inverse.time_constant_s": "model.parameters.thermal_time_constant",
            "inverse.low": "limits.low, or where the model can be controlled",
            "inverse.high": "limits.high, likewise",
            **preisach_sources("deflection", "deflection_preisach"),
        },
    )
