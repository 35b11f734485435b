"""No control: the setpoints are levels of the first command, played as they are (excitation, self-sensing)."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.controllers.pi import TERMS, CommandTerms
from rtctl.interfaces import ControlAction, Estimate


class PlaybackController:
    """`Controller` whose first command for the next period is the upcoming setpoint, while `others` are held."""

    preview_s = 0.0

    def __init__(self, unit: str = "mA", others: Sequence[float] = ()) -> None:
        """`unit` of the first command; `others`: levels of the further ones."""
        self.terms = tuple((name, unit) for name in TERMS)
        self._others = tuple(others)

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Nothing to prepare."""

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """The upcoming setpoint."""
        return ControlAction((upcoming, *self._others), CommandTerms(0.0, 0.0, upcoming))

    def applied(self, levels: Sequence[float]) -> None:
        """Limits change nothing here: the record shows what was applied."""
