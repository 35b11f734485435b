"""The play operator on a drive: what follows it stays within +-width of it, and moves only where it must.

Reference: Krasnosel'skii, Pokrovskii, Systems with Hysteresis, 1989, section 2.
"""

from __future__ import annotations

from plant_sim.oscillator.integration.holds import compiled
from rtctl.border.arrays import FloatArray


@compiled
def follow_play(state: FloatArray, nodes: FloatArray, width: float, out: FloatArray) -> None:
    """Fill `out` (steps, 3) with the play behind `nodes` (steps, 3), from `state` (1,), left at the end."""
    w = state[0]
    for i in range(nodes.shape[0]):
        for k in range(3):
            w = min(max(w, nodes[i, k] - width), nodes[i, k] + width)
            out[i, k] = w
    state[0] = w
