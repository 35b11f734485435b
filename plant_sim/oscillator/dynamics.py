"""An oscillator with its mechanisms as `rtctl.border.exported.dynamics.Dynamics`.

State order: displacement, velocity, the states of mechanisms in the equation, then those of the path: the drive
behind a lag; the second mode and its rate; what a high-pass takes off; the reading behind a lag.
"""

from __future__ import annotations

import math

import numpy as np

from plant_sim.oscillator.device_table import signal_units
from plant_sim.oscillator.equation.terms import RUBBING, TERMS, law_for
from plant_sim.oscillator.integration.friction import fading_resistance
from plant_sim.oscillator.mechanism import Driven, Moved, OscillatorMechanism, Values
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.streaming import WITHOUT_MEMORY
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.exported.dynamics import Channel, Dynamics
from rtctl.border.mechanisms import drift_of, without_brackets
from rtctl.border.model_file import ModelFile

WITH_STATES: dict[str, tuple[str, ...]] = {
    "drive.lag": ("drive.lag",),
    "mode.second": ("mode.second", "mode.second.rate"),
    "sensor.highpass": ("sensor.highpass",),
    "sensor.lag": ("sensor.lag",),
}
"""States of the mechanisms outside the equation that are differential equations."""
POINTWISE = WITHOUT_MEMORY | {"input.gain_drift"}


def oscillator_dynamics(model: ModelFile, source: str) -> Dynamics:
    """Return the equations, in the units of the model's drive gain.

    Raises:
        InputError: A mechanism is no differential equation; it is named.
    """
    simulation = oscillator_simulation(model, signal_units(model, source), source)
    values = np.array([[one.value for one in simulation.parameters]])
    acting = sorted(
        (one for one in simulation.mechanisms if simulation.acts(one, values)), key=lambda one: one.stage
    )
    for one in acting:
        outside = one.input is not None or one.drive is not None or one.sensor is not None
        if outside and one.id not in POINTWISE | WITH_STATES.keys():
            raise InputError(
                f"{source}: {one.id} is no differential equation; take the table out, or export the model as a unit"
            )
    equation = Equation.of(simulation.parameters, acting, values)
    law = _Law(equation, [(one, simulation.values_of(one, values[0])) for one in acting])
    u, z = simulation.units["drive"], simulation.units["displacement"]
    rate = without_brackets(f"({z})/s")
    return Dynamics(
        kind="oscillator",
        inputs=(Channel(name="drive", unit=u),),
        states=(
            Channel(name="displacement", unit=z), Channel(name="velocity", unit=rate),
            *(Channel(name=name, unit=unit) for name, unit in law.further_states(u, z)),
        ),
        outputs=(Channel(name="displacement", unit=z), Channel(name="velocity", unit=rate)),
        initial=law.initial(),
        rates=law.rates,
        read=law.read,
    )  # fmt: skip


class _Law:
    """The rates and outputs of an oscillator whose parameters are its model's."""

    def __init__(self, equation: Equation, mechanisms: list[tuple[OscillatorMechanism, Values]]) -> None:
        self._equation, self._mechanisms = equation, mechanisms
        self._memoryless = law_for(equation.terms - RUBBING, memory=bool(equation.memories))
        self._rubs = bool(equation.rows[[TERMS.index(term) for term in RUBBING]].any())
        self._path = [name for one, values in mechanisms for name in _states_of(one, values)]

    def further_states(self, drive: str, displacement: str) -> list[tuple[str, str]]:
        """Return names and units of the states after displacement and velocity; "": the mechanism's own."""
        own = [(f"mechanism.{k}", "") for k in range(self._equation.states)]
        units = {"drive.lag": drive, "mode.second.rate": without_brackets(f"({displacement})/s")}
        return [*own, *((name, units.get(name, displacement)) for name in self._path)]

    def initial(self) -> FloatArray:
        """Return the states at rest."""
        own = self._equation.own_start(np.zeros(1), np.zeros(1))[:, 0]
        return np.concatenate((np.zeros(2), own, np.zeros(len(self._path))))

    def rates(self, t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        """Return the time derivatives of all states."""
        found = np.zeros(len(x))
        path = dict(zip(self._path, range(len(x) - len(self._path), len(x)), strict=True))
        drive = np.full((1, 3), float(u[0]))
        for one, values in self._mechanisms:
            if one.id == "drive.lag":
                at = path["drive.lag"]
                found[at] = (drive[0, 0] - x[at]) / values["time_constant"]
                drive = np.full((1, 3), x[at])
            elif one.id == "input.gain_drift":
                drive = drive * (1.0 + values["rate"] * float(drift_of(np.array(t), values["settling_time"])))
            elif one.drive is not None:
                drive = one.drive(Driven(drive, 1.0), values).nodes
        level = float(drive[0, 0])
        found[0] = x[1]
        found[1] = self._acceleration(t, x, level, found)
        self._sensor_rates(x, level, path, found)
        return found

    def _acceleration(self, t: float, x: FloatArray, u: float, found: FloatArray) -> float:
        z, v, rows = float(x[0]), float(x[1]), self._equation.rows
        total, row, first = float(self._memoryless(z, v, u, t, rows, 0)), len(TERMS), 2
        for memory, constants in zip(self._equation.memories, self._equation.constants, strict=True):
            own = tuple(x[first : first + memory.states].tolist())
            force, rates = memory.law(z, v, u, t, own, rows, row, 0)
            total += float(force)
            if memory.damping is not None:
                total -= float(memory.damping(z, rows, row, 0)[1]) * v
            found[first : first + memory.states] = rates
            first, row = first + memory.states, row + constants
        return total - float(fading_resistance(v, total, rows, 0)) if self._rubs else total

    def _sensor_rates(self, x: FloatArray, u: float, path: dict[str, int], found: FloatArray) -> None:
        """Fill the rates of the path behind the motion."""
        z = float(x[0])
        for one, values in self._mechanisms:
            if one.id == "mode.second" and "mode.second" in path:
                q, rate = path["mode.second"], path["mode.second.rate"]
                angular = 2.0 * math.pi * values["frequency"]
                found[q] = x[rate]
                found[rate] = (
                    values["gain"] * u - 2.0 * values["damping_ratio"] * angular * x[rate] - angular**2 * x[q]
                )
                z += float(x[q])
            elif one.id == "sensor.highpass":
                at = path[one.id]
                found[at] = values["rate"] * (z - x[at])
                z -= float(x[at])
            elif one.id == "sensor.lag":
                found[path[one.id]] = (z - x[path[one.id]]) / values["time_constant"]

    def read(self, t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        """Return the reading of the displacement, and the velocity."""
        path = dict(zip(self._path, x[len(x) - len(self._path) :].tolist(), strict=True))
        z, v = float(x[0]) + path.get("mode.second", 0.0), float(x[1]) + path.get("mode.second.rate", 0.0)
        z -= path.get("sensor.highpass", 0.0)
        z = path.get("sensor.lag", z)
        moved = Moved(
            displacement=np.array([z]), velocity=np.array([v]), time_s=np.array([t]), period_s=1.0,
            drive=Driven(np.zeros((0, 3)), 1.0), substeps=1,
        )  # fmt: skip
        for one, values in self._mechanisms:
            if one.sensor is not None and one.id in POINTWISE:
                moved = one.sensor(moved, values)
        return np.array([float(moved.displacement[0]), v])


def _states_of(mechanism: OscillatorMechanism, values: Values) -> tuple[str, ...]:
    """Return the names of the states of a mechanism outside the equation."""
    if mechanism.id == "mode.second" and values["gain"] == 0.0:
        return ()
    return WITH_STATES.get(mechanism.id, ())
