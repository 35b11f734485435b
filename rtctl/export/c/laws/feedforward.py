"""The feedforward through the inverse of the model, as an exported part."""

from __future__ import annotations

from typing import Any

from rtctl.controllers.feedforward import inverse_step


def feedforward(s: Any, c: Any, upcoming: float, elapsed_s: float) -> float:
    """Return the command [mA] that brings the model's deflection to `upcoming` [um] in one period."""
    return inverse_step(s.feedforward, upcoming, elapsed_s, c.inverse, c.deflection)
