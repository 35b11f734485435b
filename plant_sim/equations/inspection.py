"""What a device of equations really does, and its parameters by name (`parameters.k1`), set while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError

PREFIX = "parameters."


class EquationsInspection:
    """A look into a device."""

    def __init__(self, system: System, p: FloatArray, truth: Callable[[], tuple[float, ...]]) -> None:
        """Look at a device.

        Args:
            system: Its equations.
            p: Its parameters (parameters, 1) [SI], which are set in place.
            truth: Returns outputs and states, each in its unit.
        """
        self._known = {PREFIX + one.name: one for one in system.parameters}
        self._places = {name: k for k, name in enumerate(self._known)}
        self._p, self.truth = p, truth
        outputs = [(f"true_{one.name}", one.unit) for one in system.outputs]
        states = [(f"state_{one.name}", one.unit) for one in system.states]
        self.truths: Sequence[tuple[str, str]] = (*outputs, *states)
        self.switches: Mapping[str, str] = {name: one.unit for name, one in self._known.items()}

    def values(self) -> dict[str, float]:
        """Return the parameters, each in its unit."""
        return {name: float(self._p[self._places[name], 0]) / one.factor for name, one in self._known.items()}

    def check(self, name: str, value: float) -> None:
        """Raise InputError where a parameter cannot have this value."""
        one = self._known[name]
        if not one.low <= value <= one.high:
            raise InputError(
                f"{name} = {value:g} {one.unit}: must lie between {one.low:g} and {one.high:g}, the bounds of the model"
            )

    def switch(self, name: str, value: float) -> None:
        """Give a parameter another value."""
        self._p[self._places[name], 0] = value * self._known[name].factor
