"""The protocol of every simulated plant: physics with its sensing, without wire, clock or watchdog."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rtctl.border.records import DeviceProfile


class Plant(Protocol):
    """A simulated plant: command levels in, readings out. Time passes only in `step` and `advance`."""

    profile: DeviceProfile
    identity: str
    """ASCII, at most 16 characters."""
    low: tuple[float, ...]
    """The device's own lower limit of each command, in the profile's units; levels beyond are clamped."""
    high: tuple[float, ...]
    safe: tuple[float, ...]
    """Levels that the device takes by itself when its watchdog trips."""

    def reset(self) -> None:
        """Reset to power-up: full cooling, clocks and noise from the start."""
        ...

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` for `dt_s` [s]."""
        ...

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return readings of the sensed channels and the reference, noise and converter included."""
        ...

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`, in one (a lockstep sample)."""
        ...
