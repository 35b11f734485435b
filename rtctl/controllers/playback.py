"""No control: the setpoints are command levels, played as they are (excitation, open-loop self-sensing)."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.interfaces import ControlAction, Estimate


class PlaybackController:
    """`Controller` whose command for the next period is the upcoming setpoint."""

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Nothing to prepare."""

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """The upcoming setpoint."""
        return ControlAction((upcoming,), 0.0, 0.0, upcoming)

    def applied(self, levels: Sequence[float]) -> None:
        """Limits change nothing here: the record shows what was applied."""
