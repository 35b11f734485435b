"""A model file's numbers in the units of the data: names, units and mechanisms checked, all findings at once."""

from __future__ import annotations

from collections.abc import Mapping

from plant_sim.oscillator.mechanism import OscillatorMechanism, in_units
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.nominal import NOMINAL_PARAMETERS
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.steady.simulation import SteadySimulation, steady_simulation
from rtctl.border.errors import InputError, nearest
from rtctl.border.mechanisms import Parameter, without_brackets
from rtctl.border.model_file import ModelFile, Value
from rtctl.border.motion import lowest_response, with_displacement
from rtctl.border.simulation import FreeParameter

NOMINAL_NAMES = tuple(parameter.name for parameter in NOMINAL_PARAMETERS)


def simulation_of_data(
    model: ModelFile, units: Mapping[str, str], source: str
) -> OscillatorSimulation | SteadySimulation:
    """Return the simulation of `model` for records in time, or, where `units` have a "frequency", for sweeps.

    Raises:
        InputError: something in the model is wrong, or does not act in a steady state; it names `source`.
    """
    if "frequency" not in units:
        return oscillator_simulation(model, units, source)
    of_signals = {name: unit for name, unit in units.items() if name != "frequency"}
    return steady_simulation(oscillator_simulation(model, of_signals, source), source)


def oscillator_simulation(model: ModelFile, units: Mapping[str, str], source: str) -> OscillatorSimulation:
    """Return the simulation of `model` in the data's `units` of "drive" and of the response.

    It has the acceleration as an output where `units` have it.

    Raises:
        InputError: something in the model is wrong; it names `source`.
    """
    outputs = ("displacement", "velocity", *(["acceleration"] if "acceleration" in units else []))
    response = lowest_response(units) or "displacement"
    units = with_displacement(units)
    units = {"velocity": without_brackets(f"({units['displacement']})/s"), **units}
    reading = _Reading(units, source, response)
    for name in model.model.parameters.keys() - set(NOMINAL_NAMES):
        reading.problem(f"unknown parameter model.parameters.{name}{nearest(name, NOMINAL_NAMES)}")
    parameters = [
        reading.parameter(declared, model.model.parameters.get(declared.name), "model.parameters", "")
        for declared in NOMINAL_PARAMETERS
    ]
    mechanisms = []
    for index, table in enumerate(model.model.mechanisms):
        where = f"model.mechanisms.{index}"
        if table.id not in MECHANISMS:
            reading.problem(
                f'{where}.id = "{table.id}" is no mechanism of an oscillator{nearest(table.id, MECHANISMS)}'
            )
            continue
        mechanism = in_units(MECHANISMS[table.id], units)
        mechanisms.append(mechanism)
        parameters += reading.of_mechanism(mechanism, table.parameters, where)
    reading.raise_all()
    return OscillatorSimulation(
        parameters=tuple(parameters),
        mechanisms=tuple(mechanisms),
        units=units,
        outputs=outputs,
        response=response,
    )


class _Reading:
    """The units, and the findings so far."""

    def __init__(self, units: Mapping[str, str], source: str, response: str) -> None:
        self._units, self._source, self._lines = units, source, list[str]()
        self._response = response

    def problem(self, text: str) -> None:
        self._lines.append(f"{self._source}: {text}")

    def raise_all(self) -> None:
        if self._lines:
            raise InputError("\n".join(self._lines))

    def of_mechanism(
        self, mechanism: OscillatorMechanism, given: Mapping[str, Value], where: str
    ) -> list[FreeParameter]:
        names = [declared.name for declared in mechanism.parameters]
        for name in given.keys() - set(names):
            self.problem(
                f"unknown parameter {where}.parameters.{name} of {mechanism.id}{nearest(name, names)}"
            )
        forms = {name for name in mechanism.forms if name in given and given[name].value != 0.0}
        for declared in mechanism.parameters:
            needed = declared.default is None or declared.of_form in forms
            if declared.name not in given and needed:
                unit = self._unit(declared)
                self.problem(f"{where}.parameters.{declared.name} [{unit}] of {mechanism.id} is missing")
        amplitudes = [declared.name for declared in mechanism.amplitudes if declared.default is not None]
        if len(amplitudes) == len(mechanism.amplitudes) and not given.keys() & set(amplitudes):
            self.problem(f"{where}.parameters of {mechanism.id} need at least one of {', '.join(amplitudes)}")
        return [
            self.parameter(declared, given.get(declared.name), f"{where}.parameters", mechanism.id)
            for declared in mechanism.parameters
        ]

    def parameter(
        self, declared: Parameter, given: Value | None, where: str, mechanism: str
    ) -> FreeParameter:
        unit = self._unit(declared)
        value = low = high = 0.0
        if given is None:
            value = declared.default or 0.0
        else:
            try:
                value = given.to(unit)
            except ValueError as error:
                self.problem(f"{where}.{declared.name}: {error}")
            if not declared.low <= value <= declared.high:
                self.problem(
                    f"{where}.{declared.name} = {value:g} {unit} must lie between "
                    f"{declared.low:g} and {declared.high:g}"
                )
        low, high = declared.low, declared.high
        name = f"{mechanism}.{declared.name}" if mechanism else declared.name
        is_step = mechanism != "" and MECHANISMS[mechanism].by_levels
        fixed = is_step or given is None or given.fixed or value == declared.simplest
        return FreeParameter(name, unit, value, low, high, fixed, declared, mechanism)

    def _unit(self, declared: Parameter) -> str:
        units = self._units
        return declared.unit_in(z=units["displacement"], u=units["drive"], y=units[self._response])
