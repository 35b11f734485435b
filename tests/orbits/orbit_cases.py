"""Models under harmonic drive for the tests of what becomes of them."""

from __future__ import annotations

import numpy as np

from rtctl.border.model_file import ModelFile
from rtctl.orbits.forced import Drive, Lanes
from rtctl.wiring_models import build_forced

HM = {"damping": 0.3, "stiffness": -4275.6, "stiffness_cubic": 88.2}
LINEAR = {"damping": 4.0, "stiffness": 5000.0}
UNITS = {"damping": "1/s", "stiffness": "1/s^2", "stiffness_cubic": "1/(mm^2*s^2)", "drive_gain": "mm/m"}


def drive(numbers: dict[str, float], steps_per_period: int = 128) -> Drive:
    """An oscillator in mm, its drive in m/s^2 with a factor of 1."""
    given = {**numbers, "drive_gain": 1000.0}
    parameters = {name: {"value": value, "unit": UNITS[name]} for name, value in given.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    return Drive(build_forced(model, {"drive": "m/s^2", "displacement": "mm"}, "test"), steps_per_period)


def lanes(of: Drive, frequencies: list[float], amplitude: float = 3.81) -> Lanes:
    """One lane a frequency."""
    own = np.array([parameter.value for parameter in of.model.parameters])
    return Lanes(
        np.tile(own, (len(frequencies), 1)), np.array(frequencies), np.full(len(frequencies), amplitude)
    )
