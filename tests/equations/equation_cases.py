"""Model files of equations for tests."""

from __future__ import annotations

from pathlib import Path

from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from plant_sim.equations.simulation import EquationsSimulation

TANKS = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x1 = { unit = "cm", rate = "-k1*sqrt(max(x1,0)) + k4*u", initial = 3.0, low = 0 }
x2 = { unit = "cm", rate = "k2*sqrt(max(x1,0)) - k3*sqrt(max(x2,0))", initial = 3.0, low = 0 }
[model.outputs]
y = { unit = "V", value = "c*x2" }
[model.parameters]
k1 = { value = 0.05, unit = "cm^0.5/s" }
k2 = { value = 0.06, unit = "cm^0.5/s" }
k3 = { value = 0.04, unit = "cm^0.5/s" }
k4 = { value = 0.03, unit = "cm/s/V" }
c = { value = 0.8, unit = "V/cm" }
"""

OSCILLATOR = """
[model]
kind = "equations"
[model.inputs]
drive = { unit = "V" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "drive_gain*drive - damping*v - (stiffness + stiffness_cubic*z^2)*z" }
[model.outputs]
displacement = { unit = "mm", value = "z" }
[model.parameters]
damping         = { value = 4.0,    unit = "1/s" }
stiffness       = { value = 8882.6, unit = "1/s^2" }
stiffness_cubic = { value = 6.0e5,  unit = "1/(mm^2*s^2)" }
drive_gain      = { value = 300.0,  unit = "mm/s^2/V" }
"""


def written(folder: Path, text: str, name: str = "model.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def simulation_of(folder: Path, text: str, units: dict[str, str]) -> EquationsSimulation:
    path = written(folder, text)
    return equations_simulation(read_equations(path), units, str(path))
