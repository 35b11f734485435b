"""A VO2 model file's mechanisms in the simulation's units: names, units and limits checked, all findings at once."""

from __future__ import annotations

from collections.abc import Mapping

from rtctl.border.errors import InputError, nearest
from rtctl.border.mechanisms import Parameter
from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.simulation import FreeParameter
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.mechanisms import MECHANISMS
from rtctl.simulations.vo2.nominal import nominal_parameters
from rtctl.simulations.vo2.simulation import Vo2Simulation

UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
"""Units of every vo2 dataset once it is read."""


def vo2_simulation(model: Vo2Model, units: Mapping[str, str], source: str) -> Vo2Simulation:
    """Return the simulation of `model`. Raises InputError that names `source`, its file."""
    wrong = [f"{name} in {units[name]}" for name in UNITS.keys() & units.keys() if units[name] != UNITS[name]]
    findings = [f"{source}: a vo2 is simulated in mA, ohm and um, not with {one}" for one in wrong]
    parameters, mechanisms = nominal_parameters(model), []
    for one in parameters:
        findings += _outside(one, f"{source}: model.parameters.{one.name}")
    for index, table in enumerate(model.mechanisms):
        where = f"{source}: model.mechanisms.{index}"
        if table.id not in MECHANISMS:
            findings.append(
                f'{where}.id = "{table.id}" is no mechanism of a vo2{nearest(table.id, MECHANISMS)}'
            )
            continue
        mechanism = MECHANISMS[table.id]
        findings += _names(mechanism, table, where)
        mechanisms.append(mechanism)
        for declared in mechanism.parameters:
            parameters.append(
                _parameter(declared, table.parameters.get(declared.name), mechanism.id, where, findings)
            )
    if findings:
        raise InputError("\n".join(findings))
    return Vo2Simulation(model=model, parameters=tuple(parameters), mechanisms=tuple(mechanisms))


def _names(mechanism: Vo2Mechanism, table: MechanismTable, where: str) -> list[str]:
    """Return findings on parameters that are unknown or missing, or that leave the mechanism without effect."""
    names = [declared.name for declared in mechanism.parameters]
    found = [
        f"{where}: unknown parameter {name} of {mechanism.id}{nearest(name, names)}"
        for name in table.parameters.keys() - set(names)
    ]
    for declared in mechanism.parameters:
        if declared.is_shape and declared.default is None and declared.name not in table.parameters:
            found.append(f"{where}.parameters.{declared.name} [{declared.unit}] of {mechanism.id} is missing")
    amplitudes = [declared.name for declared in mechanism.amplitudes]
    if not table.parameters.keys() & set(amplitudes):
        found.append(f"{where}.parameters of {mechanism.id} need at least one of {', '.join(amplitudes)}")
    return found


def _parameter(
    declared: Parameter, given: Value | None, mechanism: str, where: str, findings: list[str]
) -> FreeParameter:
    """Return one number of a mechanism, from the file or at its neutral value; problems go to `findings`."""
    value = next((x for x in (declared.neutral, declared.default) if x is not None), 1.0)
    if given is not None:
        try:
            value = given.to(declared.unit)
        except ValueError as error:
            findings.append(f"{where}.parameters.{declared.name}: {error}")
    is_step = MECHANISMS[mechanism].by_levels
    fixed = is_step or given is None or given.fixed
    found = FreeParameter(
        f"{mechanism}.{declared.name}", declared.unit, value, declared.low, declared.high, fixed, declared, mechanism
    )  # fmt: skip
    findings += _outside(found, f"{where}.parameters.{declared.name}")
    return found


def _outside(one: FreeParameter, where: str) -> list[str]:
    if one.low <= one.value <= one.high:
        return []
    return [f"{where} = {one.value:g} {one.unit} must lie between {one.low:g} and {one.high:g} {one.unit}"]
