"""The thermal observer as an exported estimator."""

from __future__ import annotations

import math
from typing import Any

from rtctl.estimators.observer import observer_step


def observer(
    s: Any, c: Any, level: float, sensed: float, elapsed_s: float
) -> tuple[float, float, float, int]:
    """Return deflection [um], surrogate [mA], standard error [um] and status bits."""
    value, surrogate, error, status = observer_step(
        s.filter, s.resistance_stack, s.probed_stack, s.deflection_stack, level, sensed, elapsed_s,
        c.observer, c.resistance, c.deflection,
    )  # fmt: skip
    return value, surrogate, math.sqrt(error * error + c.fit.error * c.fit.error), status
