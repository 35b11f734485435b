"""A model of one's own equations as a MATLAB function: [dx, y] = NAME(t, x, u, p), each in its file's unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from plant_sim.equations.compiled.source import Dialect, law_source, numbers_source
from plant_sim.equations.exported.extended import expressed_system
from plant_sim.equations.language.tree import written
from plant_sim.equations.system import System
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError

MATLAB = Dialect(
    line="{variable} = {value};",
    parameter="p({k} + 1)",
    power="{base}^({exponent})",
    choice="choose({condition}, {one}, {other})",
    either=" | ",
    both=" & ",
    negation="~{of}",
    unequal="~=",
    also="&",
)
LOCAL = """
function z = choose(condition, x, y)
if condition, z = x; else, z = y; end
end

function y = fabs(x)
y = abs(x);
end
"""
"""Functions that laws call and MATLAB has not under their names."""


def equations_function(model: EquationsFile, source: str, name: str) -> str:
    """Return the source of the function `name`, for MATLAB and Octave.

    Raises:
        InputError: The model has events, or a mechanism that is no term of the equations.
    """
    system = expressed_system(model, source)
    if system.events:
        raise InputError(
            f"{source}: model.events: {', '.join(one.name for one in system.events)}: states that jump are no "
            "differential equation; export the model as a unit (rtctl export fmu), which Simulink imports"
        )
    return function_source(system, name)


def function_source(system: System, name: str) -> str:
    """Return the source of the function of a system without events."""
    return "\n".join((*_head(system, name), *_laws(system), LOCAL))


def _head(system: System, name: str) -> Iterator[str]:
    yield f"function [dx, y] = {name}(t, x, u, p)"
    yield f"%{name.upper()}  Rates dx and outputs y of a model at time t [s], states x and inputs u."
    yield "%"
    for k, state in enumerate(system.states, start=1):
        yield f"%   x({k})  state {state.name} [{state.unit}]"
    for k, one in enumerate(system.inputs, start=1):
        yield f"%   u({k})  input {one.name} [{one.unit}]"
    for k, output in enumerate(system.outputs, start=1):
        yield f"%   y({k})  output {output.name} [{output.unit}] = {written(output.value)}"
    for k, parameter in enumerate(system.parameters, start=1):
        yield f"%   p({k})  parameter {parameter.name} [{parameter.unit}] = {parameter.value!r}"
    for state in system.states:
        yield f"%   d {state.name} / dt = {written(state.rate)}"
    initial = " ".join(repr(one.initial / one.factor) for one in system.states)
    inputs = ", ".join("0.0" for _ in system.inputs)
    yield f"%   [t, x] = ode45(@(t, x) {name}(t, x, [{inputs}]), [0 1], [{initial}])"
    values = "; ".join(repr(float(one.value)) for one in system.parameters)
    yield f"if nargin < 4, p = [{values}]; end"
    yield f"x = x(:) .* {_column(one.factor for one in system.states)}; % in SI base units, as all below"
    yield f"u = u(:) .* {_column(one.factor for one in system.inputs)};"
    yield f"p = p(:) .* {_column(one.factor for one in system.parameters)};"


def _laws(system: System) -> Iterator[str]:
    variables = "".join(f"    x{k} = x({k + 1});\n" for k in range(len(system.states)))
    variables += "".join(f"    u{k} = u({k + 1});\n" for k in range(len(system.inputs)))
    states, outputs = (
        _column(one.factor for one in channels) for channels in (system.states, system.outputs)
    )
    yield law_source(system, variables, f"dx = [{{rates}}].' ./ {states};", limited=True, dialect=MATLAB)
    values = tuple(one.value for one in system.outputs)
    yield numbers_source(system, values, "", f"y = [{{numbers}}].' ./ {outputs};", MATLAB)
    yield "end"


def _column(factors: Iterable[float]) -> str:
    listed = "; ".join(repr(float(one)) for one in factors)
    return f"[{listed}]" if listed else "zeros(0, 1)"
