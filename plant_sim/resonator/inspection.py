"""What a magnetoelectric resonator really does, at each moment of its drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from plant_sim.inspection import NoInspection


class MeInspection(NoInspection):
    """A look into a device; it has no effects that could be switched."""

    truths: Sequence[tuple[str, str]] = (("true_displacement", "um"), ("true_coil_current", "mA"))

    def __init__(self, truth: Callable[[], tuple[float, ...]]) -> None:
        self._truth = truth

    def truth(self) -> tuple[float, ...]:
        """Return displacement and coil current now."""
        return self._truth()
