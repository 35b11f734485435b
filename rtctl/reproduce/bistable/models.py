"""The paper's models, the truth of our shaker campaign, and their well: z'' + d z' + a z + b z^3 + g z^5 = f, in mm, s.

The truth is the quintic that has both what the heuristic method measures on the paper's beam (wells at 6.9625 mm,
14.717 Hz: the paper's HM) and the large-amplitude force that its regression found (RM5's at 12.5 mm): three conditions,
three coefficients. So HM is right in the wells and wrong outside, as the paper finds it, and it is known by how much.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile

OUTER_MM = 12.5
"""Displacement where the truth's force is RM5's: the campaign's largest regular displacements are 11 to 15 mm."""


class Beam(NamedTuple):
    """Coefficients in 1/s, 1/s^2, 1/(mm^2 s^2), 1/(mm^4 s^2)."""

    damping: float
    stiffness: float
    cubic: float
    quintic: float = 0.0

    def force(self, z: FloatArray) -> FloatArray:
        """Return the restoring force per mass [mm/s^2] at z [mm]."""
        square = z * z
        return np.asarray(z * (self.stiffness + square * (self.cubic + square * self.quintic)))

    @property
    def well_mm(self) -> float:
        """Displacement of the stable equilibrium [mm]; NaN where there is none."""
        a, b, g = self.stiffness, self.cubic, self.quintic
        if g == 0.0:
            square = -a / b if b != 0.0 else math.nan
        else:
            root = b * b - 4.0 * a * g
            square = (-b + math.sqrt(root)) / (2.0 * g) if root >= 0.0 else math.nan
        return math.sqrt(square) if square > 0.0 else math.nan

    @property
    def well_hz(self) -> float:
        """Frequency of small free oscillations there [Hz]; NaN where there is none."""
        square = self.well_mm**2
        rate = self.stiffness + 3.0 * self.cubic * square + 5.0 * self.quintic * square * square
        return math.sqrt(rate) / (2.0 * math.pi) if rate > 0.0 else math.nan

    @property
    def guard_mm(self) -> float:
        """Displacement beyond which the motion is unbounded [mm]; infinite where there is none."""
        if self.quintic >= 0.0:
            return math.inf
        root = self.cubic**2 - 4.0 * self.stiffness * self.quintic
        return math.sqrt((-self.cubic - math.sqrt(root)) / (2.0 * self.quintic)) if root > 0.0 else math.nan


HM = Beam(0.3, -4275.6, 88.2)
"""The heuristic model; the sign of its stiffness is lost in print."""
RM5 = Beam(0.9, -3558.6, 82.1, -1.34e-2)
RM5C = Beam(0.9, -3832.4, 76.9, 4.5e-2)


def heuristic(well_mm: float, well_hz: float, damping: float) -> Beam:
    """Return the model of the paper's equation (2), from the wells' place and their frequency of small oscillations."""
    stiffness = -0.5 * (2.0 * math.pi * well_hz) ** 2
    return Beam(damping, stiffness, -stiffness / well_mm**2)


def _truth() -> Beam:
    square, outer = HM.well_mm**2, OUTER_MM
    conditions = [
        [1.0, square, square**2],
        [1.0, 3.0 * square, 5.0 * square**2],
        [outer, outer**3, outer**5],
    ]
    wanted = [0.0, (2.0 * math.pi * HM.well_hz) ** 2, float(RM5.force(np.array(outer)))]
    a, b, g = np.linalg.solve(conditions, wanted).tolist()
    return Beam(RM5.damping, a, b, g)


TRUTH = _truth()


class SecondMode(NamedTuple):
    """Second mode of the beam, which the displacement sensor sees beside the first."""

    gain: float
    """Factor on the base's acceleration."""
    frequency_hz: float
    damping_ratio: float


def model_file(beam: Beam, gain: float = 1.0, second: SecondMode | None = None) -> ModelFile:
    """Return a model file whose drive is the base's acceleration [m/s^2], times `gain`."""
    numbers = {
        "damping": (beam.damping, "1/s"), "stiffness": (beam.stiffness, "1/s^2"),
        "stiffness_cubic": (beam.cubic, "1/(mm^2*s^2)"), "drive_gain": (1000.0 * gain, "mm/m"),
    }  # fmt: skip
    mechanisms = []
    if beam.quintic:
        quintic = {"coefficient": {"value": beam.quintic, "unit": "1/(mm^4*s^2)"}}
        mechanisms.append({"id": "stiffness.quintic", "parameters": quintic})
    if second is not None:
        shape = {
            "gain": {"value": 1000.0 * second.gain, "unit": "mm/m"},
            "frequency": {"value": second.frequency_hz, "unit": "Hz"},
            "damping_ratio": {"value": second.damping_ratio, "unit": "dimensionless"},
        }
        mechanisms.append({"id": "mode.second", "parameters": shape})
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()}
    return ModelFile.model_validate(
        {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": mechanisms}}
    )
