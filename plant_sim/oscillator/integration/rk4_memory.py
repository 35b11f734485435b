"""`rk4` for laws with states of their own: the same method, the states moved along with displacement and velocity."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.oscillator.equation.memory import loaded, moved, store
from plant_sim.oscillator.integration.friction import NOTED, as_it_is, no_resistance, not_noted

acceleration: Any = None  # replaced by `bind`
resistance: Any = no_resistance  # replaced by `bind`
note: Any = not_noted  # replaced by `bind`
settle: Any = as_it_is  # replaced by `bind`
ZEROS: Any = (0.0,)  # replaced by `bind`: as many as there are states


def rk4_memory(
    z: Any, v: Any, w: Any, nodes: Any, h: float, substeps: int, p: Any, out_z: Any, out_v: Any
) -> None:
    """As `rk4`; w (states, lanes): the laws' states, left at the end of the record."""
    lanes = z.shape[0]
    half, sixth = 0.5 * h, h / 6.0
    noted = np.empty((NOTED, lanes))
    for j in range(lanes):
        out_z[0, j], out_v[0, j] = z[j], v[j]
    row, until_sample = 1, substeps
    for i in range(nodes.shape[0]):
        u1, u2, u4 = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        t = i * h
        for j in range(lanes):
            z1, v1, w1 = z[j], v[j], loaded(ZEROS, w, j)
            a1, d1 = acceleration(z1, v1, u1, t, w1, p, j)
            held = resistance(v1, a1, p, j)
            a1 -= held
            z2, v2 = z1 + half * v1, v1 + half * a1
            a2, d2 = acceleration(z2, v2, u2, t + half, moved(w1, half, d1), p, j)
            a2 -= held
            z3, v3 = z1 + half * v2, v1 + half * a2
            a3, d3 = acceleration(z3, v3, u2, t + half, moved(w1, half, d2), p, j)
            a3 -= held
            z4, v4 = z1 + h * v3, v1 + h * a3
            a4, d4 = acceleration(z4, v4, u4, t + h, moved(w1, h, d3), p, j)
            a4 -= held
            z[j] = z1 + sixth * (v1 + 2.0 * (v2 + v3) + v4)
            v[j] = v1 + sixth * (a1 + 2.0 * (a2 + a3) + a4)
            note(noted, j, z1, v1, a1, a4, held)
            store(w, j, moved(w1, sixth, moved(moved(d1, 2.0, moved(d2, 1.0, d3)), 1.0, d4)))
        settle(z, v, noted, h, p)
        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for j in range(lanes):
                out_z[row, j], out_v[row, j] = z[j], v[j]
            row += 1
