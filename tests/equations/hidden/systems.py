"""Shipped models whose equations are written here again: no code of the program."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

from .system import HiddenSystem, Values
from .unseen import UNSEEN


def tanks(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    upper, lower = np.maximum(x, 0.0)
    spill = p["overflow"] * np.maximum(x[0] - p["rim"], 0.0)
    out = p["k3"] * np.sqrt(lower) + p["outlet"] * x[1]
    return [
        p["k4"] * u - p["k1"] * np.sqrt(upper) - spill,
        p["k2"] * np.sqrt(upper) + p["share"] * spill - out,
    ]


def circuit(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    """Flux in mWb, charge in uC, current in mA; R in ohm, L in H, C in uF."""
    flux, charge = x
    current = flux / p["inductance"] + p["saturation"] * flux**3
    return [
        1e3 * (u - p["resistance"] * current * 1e-3 - charge / p["capacitance"]),
        1e3 * current,
    ]


def motor(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    """Current in A, speed in rad/s; inductance in mH."""
    current, speed = x
    friction = (p["sliding"] + p["excess"] * np.exp(-((speed / p["film"]) ** 2))) * np.tanh(speed / p["slow"])
    friction = friction + p["viscous"] * speed
    return [
        (u - p["resistance"] * current - p["k"] * speed) / (p["inductance"] * 1e-3),
        (p["k"] * current - friction) / p["inertia"],
    ]


def body(x: FloatArray, u: FloatArray, p: Values) -> list[FloatArray]:
    inside, outside = x
    loss = p["convection"] * (outside - p["room"]) + p["radiation"] * (outside**4 - p["room"] ** 4)
    flow = p["exchange"] * (inside - outside)
    return [(u - flow) / p["capacity_inside"], (flow - loss) / p["capacity_outside"]]


SYSTEMS: dict[str, HiddenSystem] = {
    "tanks": HiddenSystem(
        model="cascaded_tanks", rates=tanks, output=lambda x, u, p: p["sensitivity"] * x[1],
        parameters={"k1": 0.05, "k2": 0.05, "k3": 0.05, "k4": 0.05, "outlet": 0.002, "overflow": 0.1, "share": 0.3,
                    "rim": 10.0, "sensitivity": 1.0},
        known=("rim", "sensitivity"),
        start=(5.0, 5.0), period_s=4.0, input=("u", "V", 2.3, 1.0), reading=("y", "V"), states=("x1", "x2"),
        hold_samples=10, references=(0.0, 0.0),
    ),
    "circuit": HiddenSystem(
        model="duffing_circuit", rates=circuit, output=lambda x, u, p: x[1] / p["capacitance"],
        parameters={"resistance": 50.0, "inductance": 0.1, "capacitance": 1.0, "saturation": 50.0},
        start=(0.0, 0.0), period_s=1e-4, input=("source", "V", 0.0, 4.0), reading=("reading", "V"),
        states=("flux", "charge"), hold_samples=4, references=(0.0, 0.0),
    ),
    "motor": HiddenSystem(
        model="dc_motor", rates=motor, output=lambda x, u, p: x[1] * 30.0 / np.pi,
        parameters={"resistance": 2.0, "inductance": 2.0, "k": 0.05, "inertia": 2e-4, "sliding": 0.01, "excess": 0.01,
                    "film": 5.0, "viscous": 1e-4, "slow": 1.0},
        known=("slow",),
        start=(0.0, 0.0), period_s=0.005, input=("voltage", "V", 0.0, 6.0), reading=("rpm", "rpm"),
        states=("current", "speed"), hold_samples=12, references=(0.0, 0.0),
    ),
    "body": HiddenSystem(
        model="heated_body", rates=body, output=lambda x, u, p: x[1],
        parameters={"exchange": 0.5, "capacity_inside": 20.0, "capacity_outside": 80.0, "convection": 0.1,
                    "radiation": 1e-9, "room": 293.15},
        known=("room",),
        start=(293.15, 293.15), period_s=10.0, input=("power", "W", 12.0, 12.0), reading=("temperature", "K"),
        states=("inside", "outside"), hold_samples=20, references=(293.15, 293.15),
    ),
} | UNSEEN  # fmt: skip
DEVELOPED_ON = ("tanks", "circuit")
"""Systems by which the search was developed; the others are for a blind check."""
