"""Systems on which the search was never developed and which are shipped nowhere; their model files lie in `models`.

`follows` lists, by the equations alone and before any run, the effects that the fitted parameters can take over: a leak
of a state that has a fitted linear loss already.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray

from .system import HiddenSystem, Values

OWN = Path(__file__).with_name("models")


def _drive(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    motor, twist, load = x
    shaft = p["stiffness"] * twist + p["damping"] * (motor - load)
    return [
        (p["torque"] * u - shaft - p["bearing"] * motor) / p["inertia_motor"],
        motor - load,
        (shaft - p["drag"] * load) / p["inertia_load"],
    ]


def _exchanger(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    hot, cold = x
    passed = p["exchange"] * (hot - cold)
    return [
        (p["heat"] * u * (p["inlet"] - hot) - passed) / p["capacity_hot"],
        (passed - p["carried"] * (cold - p["supply"])) / p["capacity_cold"],
    ]


def _chemostat(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    """Times in h here, and in s outside."""
    cells, food = x
    growth = p["fastest"] * food / (food + p["half"])
    return [
        (growth - u - p["decay"]) * cells / 3600.0,
        (u * (p["feed"] - food) - growth * cells / p["yield"]) / 3600.0,
    ]


def _cylinder(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    """Position in mm, speed in m/s, pressure in bar."""
    position, speed, pressure = x
    against = np.where(u > 0.0, pressure, -pressure)
    fed = p["gain"] * u * np.sqrt(np.maximum(p["supply"] - against, 0.0) / p["supply"])  # cm^3/s
    force = 10.0 * p["area"] * pressure - p["friction"] * speed - p["spring"] * position  # 1 bar cm^2 = 10 N
    return [
        1e3 * speed,
        force / p["mass"],
        p["bulk"] * (fed - 100.0 * p["area"] * speed - p["leakage"] * pressure),  # 1 cm^2 m/s = 100 cm^3/s
    ]


def _crane(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    cart, speed, angle, turn = x
    sine, cosine = np.sin(angle), np.cos(angle)
    pull = p["ball"] * sine * (p["rope"] * turn**2 + p["gravity"] * cosine)
    acceleration = (u - p["spring"] * cart - p["drag"] * speed + pull) / (p["mass"] + p["ball"] * sine**2)
    return [
        speed,
        acceleration,
        turn,
        -(acceleration * cosine + p["gravity"] * sine) / p["rope"] - p["pivot"] * turn,
    ]


UNSEEN: dict[str, HiddenSystem] = {
    "drive": HiddenSystem(
        model="two_mass_drive", folder=OWN, rates=_drive, output=lambda x, u, p: x[2],
        parameters={"inertia_motor": 1e-3, "inertia_load": 4e-3, "stiffness": 20.0, "damping": 0.01, "drag": 0.01,
                    "bearing": 0.005, "torque": 0.1},
        known=("bearing", "torque"),
        start=(0.0, 0.0, 0.0), period_s=0.002, input=("current", "A", 0.0, 5.0), reading=("speed", "rad/s"),
        states=("motor", "twist", "load"), hold_samples=12, references=(0.0, 0.0, 0.0),
        follows=("state.motor.leak", "state.load.leak"),
    ),
    "exchanger": HiddenSystem(
        model="heat_exchanger", folder=OWN, rates=_exchanger, output=lambda x, u, p: x[1],
        parameters={"exchange": 200.0, "capacity_hot": 8000.0, "capacity_cold": 12000.0, "carried": 150.0,
                    "heat": 4180.0, "inlet": 350.0, "supply": 285.0},
        known=("heat", "inlet", "supply"),
        start=(310.0, 295.0), period_s=4.0, input=("flow", "kg/s", 0.05, 0.045), reading=("outlet", "K"),
        states=("hot", "cold"), hold_samples=12, references=(310.0, 295.0),
        follows=("state.cold.leak",),
    ),
    "chemostat": HiddenSystem(
        model="chemostat", folder=OWN, rates=_chemostat, output=lambda x, u, p: x[0],
        parameters={"fastest": 0.5, "half": 0.2, "yield": 0.5, "decay": 0.01, "feed": 10.0},
        known=("feed",),
        start=(4.8, 0.3), period_s=720.0, input=("dilution", "1/hour", 0.22, 0.18), reading=("density", "g/L"),
        states=("cells", "food"), hold_samples=10, references=(0.0, 0.0),
        follows=("state.cells.leak",),
    ),
    "cylinder": HiddenSystem(
        model="hydraulic_cylinder", folder=OWN, rates=_cylinder, output=lambda x, u, p: x[0],
        parameters={"bulk": 14.0, "gain": 20.0, "leakage": 2.0, "friction": 1000.0, "spring": 20.0, "area": 10.0,
                    "mass": 20.0, "supply": 70.0},
        known=("area", "mass", "supply"),
        start=(0.0, 0.0, 0.0), period_s=0.005, input=("valve", "V", 0.0, 4.0), reading=("place", "mm"),
        states=("position", "speed", "pressure"), hold_samples=20, references=(0.0, 0.0, 0.0),
        follows=("state.speed.leak", "state.pressure.leak"),
    ),
    "crane": HiddenSystem(
        model="crane", folder=OWN, rates=_crane, output=lambda x, u, p: x[2],
        parameters={"spring": 20.0, "mass": 1.0, "drag": 1.0, "ball": 0.3, "rope": 0.4, "pivot": 0.1, "gravity": 9.81},
        known=("gravity",),
        start=(0.0, 0.0, 0.0, 0.0), period_s=0.02, input=("force", "N", 0.0, 4.0), reading=("swing", "rad"),
        states=("cart", "speed", "angle", "turn"), hold_samples=10, references=(0.0, 0.0, 0.0, 0.0),
        follows=("state.speed.leak", "state.turn.leak"),
    ),
}  # fmt: skip
