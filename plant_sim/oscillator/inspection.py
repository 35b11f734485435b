"""What an oscillator really does, and its mechanisms, switched while it runs (`effects.friction.coulomb.level`).

All mechanisms of the catalogue that can act sample by sample are there, those that the model file lacks at their
neutral values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from plant_sim.oscillator.mechanism import in_units
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.streaming import cannot_stream
from rtctl.border.errors import InputError
from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import FreeParameter

PREFIX = "effects."


class Inspected(Protocol):
    """What is looked at of a device (`plant_sim.oscillator.plant.OscillatorPlant`)."""

    @property
    def displacement(self) -> float:
        """The true displacement."""
        ...

    @property
    def velocity(self) -> float:
        """Its rate."""
        ...

    def put_in_force(self, simulation: OscillatorSimulation) -> None:
        """Go on as another equation from where it is."""
        ...


class OscillatorInspection:
    """A look into a device."""

    def __init__(
        self,
        plant: Inspected,
        simulation: OscillatorSimulation,
        rehearse: Callable[[OscillatorSimulation], None],
    ) -> None:
        """Look at a device.

        Args:
            plant: The device.
            simulation: Its model.
            rehearse: Compiles what a model needs. Raises ValueError where no sensible step resolves it.
        """
        self._plant, self._rehearse = plant, rehearse
        self._simulation = with_all_mechanisms(simulation)
        z = simulation.units["displacement"]
        self.truths: Sequence[tuple[str, str]] = (
            ("true_displacement", z),
            ("true_velocity", plain_unit(f"({z})/s")),
        )
        self.switches: Mapping[str, str] = {
            PREFIX + one.name: plain_unit(one.unit) for one in self._simulation.parameters if one.mechanism
        }

    def truth(self) -> tuple[float, ...]:
        """Return displacement and velocity."""
        return self._plant.displacement, self._plant.velocity

    def values(self) -> dict[str, float]:
        """Return the parameters of all mechanisms."""
        return {PREFIX + one.name: one.value for one in self._simulation.parameters if one.mechanism}

    def check(self, name: str, value: float) -> None:
        """Compile the equation with a change. Raises InputError where it is out of range, or cannot be resolved."""
        changed = self._with(name, value)
        (one,) = (one for one in changed.parameters if PREFIX + one.name == name)
        own = [other for other in changed.parameters if other.mechanism == one.mechanism]
        if any(other.value != other.declared.neutral for other in own if not other.declared.is_shape):
            for other in own:
                if not other.low <= other.value <= other.high:
                    raise InputError(
                        f"{PREFIX}{other.name} = {other.value:g} {plain_unit(other.unit)}: must lie between "
                        f"{other.low:g} and {other.high:g}; set it before the mechanism acts"
                    )
        try:
            self._rehearse(changed)
        except ValueError as error:
            raise InputError(f"{name} = {value:g}: {error}") from None

    def switch(self, name: str, value: float) -> None:
        """Give a mechanism another size or form; memories of mechanisms begin anew, the motion goes on."""
        self._simulation = self._with(name, value)
        self._plant.put_in_force(self._simulation)

    def _with(self, name: str, value: float) -> OscillatorSimulation:
        return replace(
            self._simulation,
            parameters=tuple(
                one._replace(value=value) if PREFIX + one.name == name and one.mechanism else one
                for one in self._simulation.parameters
            ),
        )


def with_all_mechanisms(simulation: OscillatorSimulation) -> OscillatorSimulation:
    """Return a model with every mechanism that can act sample by sample, those that it lacks at neutral values."""
    there = {one.id for one in simulation.mechanisms}
    parameters, mechanisms = list(simulation.parameters), list(simulation.mechanisms)
    z, u, y = (simulation.units[one] for one in ("displacement", "drive", simulation.response))
    for known in MECHANISMS.values():
        mechanism = in_units(known, simulation.units)
        values = {one.name: 1.0 for one in mechanism.parameters}
        if mechanism.id in there or cannot_stream(mechanism, values):
            continue
        mechanisms.append(mechanism)
        for declared in mechanism.parameters:
            value = declared.neutral if declared.neutral is not None else declared.default or 0.0
            parameters.append(
                FreeParameter(
                    f"{mechanism.id}.{declared.name}", declared.unit_in(z=z, u=u, y=y), value,
                    declared.low, declared.high, True, declared, mechanism.id,
                )
            )  # fmt: skip
    return replace(simulation, parameters=tuple(parameters), mechanisms=tuple(mechanisms))
