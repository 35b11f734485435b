"""The picture of static loops that were identified too coarsely, beside those that a diagnosis refitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rtctl.identification.vo2.adapted_grid import compute_switching_densities

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = "deflection"


def draw_coarse_loops(
    coarse: Mapping[str, Any], loops: Mapping[str, Any], units: Mapping[str, str]
) -> Figure:
    """Return the switching densities of the deflection's loops, and what both leave of the staircases.

    Args:
        coarse: `rtctl.identification.vo2.coarse_loops.LoopResolution` of each output.
        loops: refitted loops of each output.
        units: unit of each output.
    """
    from rtctl.plots.diagnosis_ranking import loops_figure

    shown = coarse[SHOWN]
    reads = (shown.given, loops[SHOWN])
    v, y, scored = shown.staircases
    left = tuple((y - read.simulate(v))[scored] for read in reads)
    densities = tuple(compute_switching_densities(read) for read in reads)
    return loops_figure(
        (reads[0].grid, reads[1].grid),
        (densities[0], densities[1]),
        v[scored],
        (left[0], left[1]),
        units[SHOWN],
    )
