"""No control: the setpoints are levels of the first command, played as they are (excitation, self-sensing)."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.controllers.pi import TERMS, CommandTerms
from rtctl.interfaces import ControlAction, Estimate


class PlaybackController:
    """A controller whose first command for the next period is the upcoming setpoint; further commands are held."""

    preview_s = 0.0

    def __init__(self, unit: str = "mA", others: Sequence[float] = ()) -> None:
        """Play the first command in `unit`; hold the further ones at the levels `others`."""
        self.terms = tuple((name, unit) for name in TERMS)
        self._others = tuple(others)

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Prepare nothing."""

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Return the upcoming setpoint as the first command."""
        return ControlAction((upcoming, *self._others), CommandTerms(0.0, 0.0, upcoming))

    def applied(self, levels: Sequence[float]) -> None:
        """Ignore the limits: the record shows what was applied."""
