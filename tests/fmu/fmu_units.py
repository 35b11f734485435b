"""Units of others for tests: one that is written in C after the standard alone, and data of such a device."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="heater" guid="{heater}" generationTool="by hand">
  <CoSimulation modelIdentifier="heater" canHandleVariableCommunicationStepSize="false"/>
  <UnitDefinitions>
    <Unit name="K"><BaseUnit K="1"/></Unit>
    <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
    <Unit name="W"><BaseUnit kg="1" m="2" s="-3"/></Unit>
    <Unit name="J.K-1"><BaseUnit kg="1" m="2" s="-2" K="-1"/></Unit>
    <Unit name="W/K"><BaseUnit kg="1" m="2" s="-3" K="-1"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="power" valueReference="0" causality="input" variability="continuous">
      <Real start="0" unit="W" min="0" max="50"/></ScalarVariable>
    <ScalarVariable name="reading" valueReference="1" causality="output" variability="continuous">
      <Real unit="K"/></ScalarVariable>
    <ScalarVariable name="capacity" valueReference="10" causality="parameter" variability="fixed">
      <Real start="20" unit="J.K-1" min="1"/></ScalarVariable>
    <ScalarVariable name="loss" valueReference="11" causality="parameter" variability="fixed">
      <Real start="0.5" unit="W/K"/></ScalarVariable>
    <ScalarVariable name="coupling" valueReference="12" causality="parameter" variability="fixed">
      <Real start="0.2" unit="W/K"/></ScalarVariable>
    <ScalarVariable name="sensor" valueReference="13" causality="parameter" variability="fixed">
      <Real start="0.4" unit="J.K-1" min="0.01"/></ScalarVariable>
    <ScalarVariable name="room" valueReference="14" causality="parameter" variability="fixed">
      <Real start="295" unit="K"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
SOURCE = Path(__file__).with_name("heater.c")
PERIOD_S = 0.05
MODEL = """
[model]
kind = "fmu"
file = "heater.fmu"
[model.parameters]
capacity = { value = 20.0, unit = "J/K", low = 1 }
loss = { value = 0.5, unit = "W/K", low = 0 }
sensor = { value = 0.4, unit = "J/K", low = 0.01 }
"""
"""The coupling and the room's temperature are known: a sensor tells its capacity over its coupling alone."""


def write_heater(folder: Path) -> Path:
    """Compile the unit into `folder` and return its file."""
    library = folder / "heater.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", str(library), str(SOURCE)], check=True)
    unit = folder / "heater.fmu"
    with zipfile.ZipFile(unit, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(library, "binaries/linux64/heater.so")
    return unit


def heater_course(power: FloatArray, *, late_s: float = 0.0, capacity: float = 22.0) -> FloatArray:
    """Return the readings (n,) [K] of a device of that kind, its power held, by a matrix exponential of our own."""
    from scipy.linalg import expm

    loss, coupling, sensor = 0.45, 0.2, 0.5
    a = np.array(
        [[-(loss + coupling) / capacity, coupling / capacity], [coupling / sensor, -coupling / sensor]]
    )
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[:2, 2] = a, [1.0 / capacity, 0.0]
    late = round(late_s / PERIOD_S)
    moved, x, found = expm(whole * PERIOD_S), np.zeros(2), []
    acting = np.concatenate((np.zeros(late), power))[: len(power)]
    for level in acting:
        found.append(295.0 + x[1])
        x = moved[:2, :2] @ x + moved[:2, 2] * level
    return np.array(found)


def write_heater_data(folder: Path, late_s: float) -> Path:
    """Write three records of a heater whose power acts late, and their manifest."""
    lines = ['[dataset]\nname = "heater"\nplant = "fmu"\n']
    lines.append('[signals.power]\nrole = "input"\ncolumn = "P"\nunit = "W"\nhold = "zero"\n')
    lines.append('[signals.reading]\nrole = "output"\ncolumn = "T"\nunit = "K"\n')
    rng = np.random.default_rng(3)
    for k, use in enumerate(("fit", "fit", "test")):
        levels = rng.uniform(0.0, 40.0, 8)
        levels[0] = 0.0
        power = np.repeat(levels, 50)
        reading = heater_course(power, late_s=late_s) + 0.02 * rng.standard_normal(len(power))
        rows = np.column_stack((PERIOD_S * np.arange(len(power)), power, reading))
        np.savetxt(folder / f"r{k}.csv", rows, delimiter=",", header="t,P,T", comments="", fmt="%.8g")
        lines.append(f'[[records]]\nfile = "r{k}.csv"\ntime = "t"\nuse = "{use}"\n')
    path = folder / "dataset.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path
