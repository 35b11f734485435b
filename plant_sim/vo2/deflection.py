"""Deflection of the tip: the structural transition bends one way, thermal expansion the other.

`D = D_0 + S f + e (T - T_0)`: stroke S by the structurally transformed fraction f, expansion e < 0. Because
the two oppose each other, deflection is not monotone in temperature (fig. 4c of the composite-model paper).
"""

from __future__ import annotations

from typing import Annotated

from plant_sim.bounds import FINITE
from plant_sim.kernels import Record, compiled
from rtctl.border.units.quantities import Checked, Quantity


class Deflection(Checked):
    """The `[deflection]` table."""

    rest: Annotated[float, Quantity("um"), FINITE]
    """D_0, deflection at ambient temperature with nothing transformed [um]."""
    stroke: Annotated[float, Quantity("um"), FINITE]
    """S, stroke of the whole transition [um]."""
    expansion: Annotated[float, Quantity("um/K"), FINITE]
    """e, thermal expansion, negative against a positive stroke [um/K]."""


@compiled
def deflection_at(beam: Record, rise: float, fraction: float) -> float:
    """Return the deflection [um] at `rise` [K] above ambient with the structural `fraction` transformed."""
    return float(beam.rest + beam.stroke * fraction + beam.expansion * rise)
