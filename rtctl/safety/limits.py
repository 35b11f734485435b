"""Limits of each command: its range, its slew rate, its root mean square.

They hold whatever the controller asks for; the loop applies them to every command before it is sent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.border.errors import DriverError, Fault
from rtctl.border.kernels import kernel


@kernel
def limit_command(level: float, previous: float, reach: float, low: float, high: float) -> float:
    """Return `level` within slew and range; the range comes last, so it always holds.

    Args:
        level: the level that the controller asks for; finite. All arguments are in the unit of the command.
        previous: the level that was commanded before.
        reach: the largest change from `previous`.
        low: lower end of the range.
        high: upper end of the range.
    """
    if level > previous + reach:
        level = previous + reach
    elif level < previous - reach:
        level = previous - reach
    if level < low:
        return low
    return high if level > high else level


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLimits:
    """The limits of one command, in its unit."""

    low: float
    """Lower end of the range."""
    high: float
    """Upper end of the range."""
    safe: float
    """The level at which the device is at rest."""
    slew_per_s: float = math.inf
    """Largest change per second."""
    rms: float = math.inf
    """Largest root mean square of the command over `rms_window_s` (`rtctl.safety.guards.EnergyGuard`)."""
    rms_window_s: float = 1.0
    """Time constant of the mean square [s]."""
    stop: bool = False
    """Whether a level outside the limits ends the run instead of being limited."""

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"limits: low = {self.low:g} must be below high = {self.high:g}")
        if not min(0.0, self.low) <= self.safe <= self.high:
            raise ValueError(
                f"limits: safe = {self.safe:g} must lie between {min(0.0, self.low):g} and high = {self.high:g}"
            )
        if not self.slew_per_s > 0.0:
            raise ValueError(f"limits: slew = {self.slew_per_s:g} a second must be > 0")
        if not self.rms > abs(self.safe):
            raise ValueError(
                f"limits: rms = {self.rms:g} must exceed safe = {self.safe:g}, which is held for long"
            )
        if not self.rms_window_s > 0.0:
            raise ValueError(f"limits: rms_window = {self.rms_window_s:g} s must be > 0 s")

    def clip(self, level: float, previous: float, elapsed_s: float) -> float:
        """Return `level` within range and slew.

        Args:
            level: the level that the controller asks for [unit of the command].
            previous: the level that was commanded before [unit of the command].
            elapsed_s: time since then [s].

        Raises:
            DriverError: `level` is not finite, or outside the limits while `stop` is set.
        """
        if not math.isfinite(level):
            raise DriverError(
                Fault.NOT_FINITE,
                f"the controller asked for {level}, which is no level to command; check the model",
            )
        reach = self.slew_per_s * elapsed_s
        if self.stop:
            self._refuse(level, previous, reach)
        return limit_command(level, previous, reach, self.low, self.high)

    def _refuse(self, level: float, previous: float, reach: float) -> None:
        """Raise DriverError for a level outside range or slew."""
        if not self.low <= level <= self.high:
            raise DriverError(
                Fault.LEVEL_LIMIT,
                f"the controller asked for {level:.6g}, outside {self.low:g} to {self.high:g}, and limits.stop is set",
            )
        if abs(level - previous) > reach and self.low <= previous <= self.high:
            raise DriverError(
                Fault.SLEW_LIMIT,
                f"the controller asked for a step from {previous:.6g} to {level:.6g}, more than the {reach:.4g} that "
                "limits.slew allows at once, and limits.stop is set",
            )
