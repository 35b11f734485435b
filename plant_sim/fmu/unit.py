"""A unit's description, checked: what a device needs of it and cannot do with it, all findings at once."""

from __future__ import annotations

import math
import platform
import re
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.units.unit_text import parsed_unit

VERSIONS = ("2.0", "3.0")
SCALARS = ("Real", "Float64")
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
WIDEST = 1e6
"""Limit of an input that states none, in its unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitChannel:
    """An input or an output of a unit."""

    name: str
    """Its name there, with _ for what no name of a signal may have: `bus.u[1]` is `bus_u_1`."""
    unit: str
    reference: int
    low: float = -WIDEST
    high: float = WIDEST
    start: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A unit for co-simulation."""

    path: Path
    description: Any
    """FMPy's record of modelDescription.xml."""
    inputs: tuple[UnitChannel, ...]
    outputs: tuple[UnitChannel, ...]
    fixed_step_s: float | None
    """Communication step [s] of a unit that takes no other one; None: it takes any."""


def read_unit(path: Path) -> Unit:
    """Return the unit of a file.

    Raises:
        InputError: FMPy is missing; the file is no unit; it needs something that a device here does not have, all
            findings at once.
    """
    fmpy = _fmpy(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    try:
        description = fmpy.read_model_description(str(path))
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except Exception as error:  # FMPy lets out whatever it stumbles on
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise InputError(f"{path}: it is no functional mock-up unit that FMPy reads: {said[0]}") from None
    findings = [
        f"{path}: {one}"
        for one in _findings(
            description, names, str(fmpy.platform_tuple if description.fmiVersion == "3.0" else fmpy.platform)
        )
    ]
    inputs, outputs = [], []
    for one in description.modelVariables if not findings else ():
        if one.causality == "input" and not _is_slope(description, one):
            inputs.append(_channel(one, description, path, findings))
        elif one.causality == "output":
            outputs.append(_channel(one, description, path, findings))
    names = [one.name for one in (*inputs, *outputs)]
    for name in dict.fromkeys(one for one in names if names.count(one) > 1):
        findings.append(
            f"{path}: more than one input or output would be called {name} here; name them otherwise"
        )
    if not findings and not inputs:
        findings.append(f"{path}: the unit has no input: there is nothing to command")
    if not findings and not outputs:
        findings.append(f"{path}: the unit has no output: there is nothing to read")
    if findings:
        raise InputError("\n".join(findings))
    return Unit(
        path=path, description=description, inputs=tuple(inputs), outputs=tuple(outputs),
        fixed_step_s=_fixed_step_s(description),
    )  # fmt: skip


def _fmpy(path: Path) -> Any:
    try:
        return import_module("fmpy")
    except ImportError:
        raise InputError(f"{path}: a unit needs the package FMPy: pip install 'rtctl[fmu]'") from None


def _findings(description: Any, names: list[str], system: str) -> list[str]:
    """Return what a device cannot do with a unit."""
    if description.fmiVersion not in VERSIONS:
        return [f"FMI {description.fmiVersion} is not known; known: {', '.join(VERSIONS)}"]
    shared = description.coSimulation
    if shared is None:
        return ["the unit is not for co-simulation; export it so where it comes from"]
    found = []
    if shared.needsExecutionTool:
        found.append("the unit needs the tool that it comes from while it runs; export it to run by itself")
    if not any(name.startswith(f"binaries/{system}/") for name in names):
        there = sorted(
            {name.split("/")[1] for name in names if name.startswith("binaries/") and name.count("/") > 1}
        )
        found.append(
            f"the unit has no binary for this machine ({system}; {platform.machine()}), it has "
            f"{', '.join(there) or 'none'}; compile its sources with `fmpy compile FILE.fmu` if it has them"
        )
    for one in description.modelVariables:
        if one.causality not in ("input", "output"):
            continue
        if one.type not in SCALARS:
            found.append(f"{one.causality} {one.name} is of type {one.type}; a device has real numbers alone")
        elif getattr(one, "dimensions", None):
            found.append(f"{one.causality} {one.name} is an array; a device has single numbers alone")
    return found


def _is_slope(description: Any, variable: Any) -> bool:
    """Return whether a variable is the slope of an input of one of rtctl's own units, which stays 0."""
    name, _, word = variable.name.rpartition("_")
    own = str(description.generationTool or "").startswith("rtctl")
    return own and word == "slope" and any(one.name == name for one in description.modelVariables)


def _channel(variable: Any, description: Any, path: Path, findings: list[str]) -> UnitChannel:
    low, high = (
        WIDEST * sign if bound is None else float(bound)
        for bound, sign in ((variable.min, -1.0), (variable.max, 1.0))
    )
    start = float(variable.start) if variable.start not in (None, "") else 0.0
    return UnitChannel(
        name=re.sub(r"\W+", "_", variable.name).strip("_"), reference=variable.valueReference,
        unit=_unit_of(variable, description, path, findings), low=low, high=high, start=min(max(start, low), high),
    )  # fmt: skip


def _unit_of(variable: Any, description: Any, path: Path, findings: list[str]) -> str:
    """Return the unit of a variable as pint reads it; note a finding where it is not known."""
    text = unit_text(variable, description)
    if text is None:
        findings.append(
            f'{path}: {variable.causality} {variable.name} has the unit "{_named_unit(variable)}", which is not known, '
            "and the unit does not define it by SI base units"
        )
    return text or "dimensionless"


def _named_unit(variable: Any) -> str | None:
    named: str | None = variable.unit or getattr(variable.declaredType, "unit", None)
    return named


def _as_product(modelica: str) -> str:
    """Return a unit in Modelica's notation, such as `J.K-1` or `m/s2`, with signs of multiplication and powers."""
    powers = re.sub(r"([A-Za-z]+)([-+]?\d+)", r"\1^\2", modelica)
    over = re.sub(r"(^|\.)([A-Za-z]+)\^-(\d+)", lambda found: f"/{found[2]}^{found[3]}", powers)
    return re.sub(r"\^1\b", "", f"1{over}" if over.startswith("/") else over).replace(".", "*")


def unit_text(variable: Any, description: Any) -> str | None:
    """Return the unit of a variable as pint reads it, by its name, else by its SI base units; None: it is not known."""
    named = _named_unit(variable)
    if not named:
        return "dimensionless"
    for text in (named, _as_product(named)):
        with suppress(ValueError):
            parsed_unit(text)
            return text
    base = next((one.baseUnit for one in description.unitDefinitions or () if one.name == named), None)
    if base is not None and base.factor == 1.0 and base.offset == 0.0:
        powers = [f"{word}^{getattr(base, word)}" for word in BASE_UNITS if getattr(base, word)]
        return "*".join(powers) or "dimensionless"
    return None


def _fixed_step_s(description: Any) -> float | None:
    shared = description.coSimulation
    if shared.canHandleVariableCommunicationStepSize:
        return None
    proposed = getattr(shared, "fixedInternalStepSize", None) or getattr(
        description.defaultExperiment, "stepSize", None
    )
    step_s = float(proposed) if proposed else math.nan
    return step_s if step_s > 0.0 else None
