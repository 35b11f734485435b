"""Instruments: a resistance bridge with noise and a converter, and a reference for the deflection.

`V = R I_s (1 + flicker) + white`, rounded to the converter's step, `R_read = V / I_s`. The flicker is 1/f
noise of the resistance: a sum of first-order processes with equal variance, their corner frequencies f_k an
octave apart. Each has the one-sided density `(2 variance/(pi f_k)) / (1 + (f/f_k)^2)`; with the sum over
octaves taken as an integral over `ln f_k / ln 2` they give `S(f) = variance / (f ln 2)` between the outermost
corners. Each process is propagated exactly (`a = exp(-2 pi f_k dt)`): the spectrum is the same for any step.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from plant_sim.bounds import NOT_NEGATIVE, POSITIVE
from plant_sim.kernels import Record, compiled
from rtctl.border.units.quantities import Checked, Quantity

OCTAVES = 14
LOWEST_CORNER_HZ = 0.0625
"""Lowest corner frequency [Hz]; the highest is 512 Hz."""

WHITE, REFERENCE = OCTAVES, OCTAVES + 1
NORMALS = OCTAVES + 2
"""Standard normals that a reading consumes: one per octave, one of the bridge, one of the instrument."""

_BLOCK = 1024


class Sensing(Checked):
    """The `[sensing]` table; each zero turns its imperfection off."""

    current: Annotated[float, Quantity("mA"), POSITIVE]
    """Sensing current I_s, small enough not to heat [mA]."""
    white: Annotated[float, Quantity("V"), NOT_NEGATIVE]
    """Standard deviation of the voltage in one reading [V]."""
    flicker: Annotated[float, Quantity("1/Hz^0.5"), NOT_NEGATIVE]
    """Relative 1/f noise: square root of the one-sided density of dR/R at 1 Hz [1/sqrt(Hz)]."""
    converter_range: Annotated[float, Quantity("V"), POSITIVE]
    """Range of the converter: from minus this to plus this [V]; it stays at the end beyond."""
    converter_bits: Annotated[int, Field(ge=0, le=24)]
    """Bits of the converter; 0: no rounding."""
    reference: Annotated[float, Quantity("um"), NOT_NEGATIVE]
    """Standard deviation of the external instrument in one reading [um]."""


class NoiseSource:
    """Rows of standard normals, drawn a block at a time: the same seed gives the same rows."""

    __slots__ = ("_rng", "block", "row")

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.block: NDArray[np.float64] = self._rng.standard_normal((_BLOCK, NORMALS))
        self.row = -1

    @property
    def rows(self) -> int:
        """Rows of a block."""
        return _BLOCK

    def next_row(self) -> int:
        """Return the index in `block` of a row not used before; draw the next block into the same array if needed."""
        self.row += 1
        if self.row == _BLOCK:
            self._rng.standard_normal(out=self.block)
            self.row = 0
        return self.row


@compiled
def drift(flicker: NDArray[np.float64], normals: NDArray[np.float64], dt: float) -> float:
    """Propagate the octaves by `dt` [s]; return their sum (each has variance one)."""
    decay = math.exp(-2.0 * math.pi * LOWEST_CORNER_HZ * dt)
    total = 0.0
    for k in range(OCTAVES):
        flicker[k] = decay * flicker[k] + math.sqrt(1.0 - decay * decay) * normals[k]
        total += flicker[k]
        decay *= decay  # the next corner is an octave higher
    return total


@compiled
def read_resistance(sensing: Record, resistance: float, flicker: float, white: float) -> float:
    """Return the reading [ohm] of `resistance` [ohm]; `flicker` and `white` in their own standard deviations."""
    sense_current = 1e-3 * sensing.current
    relative = sensing.flicker * math.sqrt(math.log(2.0)) * flicker
    voltage = resistance * sense_current * (1.0 + relative) + sensing.white * white
    if sensing.converter_bits > 0:
        half = 2.0 ** (sensing.converter_bits - 1)
        step = sensing.converter_range / half
        voltage = step * min(max(np.rint(voltage / step), -half), half - 1.0)
    return float(np.float64(np.float32(voltage / sense_current)))


@compiled
def read_deflection(sensing: Record, deflection: float, normal: float) -> float:
    """Return the external instrument's reading [um] of `deflection` [um]."""
    return float(np.float64(np.float32(deflection + sensing.reference * normal)))
