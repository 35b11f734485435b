"""Runge-Kutta of order 4 at a fixed step, for many parameter sets at once: a template, bound to an acceleration law.

Lanes are the innermost loop, so that the compiler works on eight at a time; one lane costs what a scalar kernel
costs. The drive is given at the three instants of each step that the method needs, which lets it jump between steps.
Dry friction, whose force jumps with the sign of the velocity, is `held` over a step and put right after it:
`plant_sim.oscillator.integration.friction`.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1, table 1.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.oscillator.equation.terms import nominal
from plant_sim.oscillator.integration.friction import NOTED, as_it_is, no_resistance, not_noted

acceleration: Any = nominal  # replaced by `bind`
resistance: Any = no_resistance  # replaced by `bind`
note: Any = not_noted  # replaced by `bind`
settle: Any = as_it_is  # replaced by `bind`


def rk4(z: Any, v: Any, nodes: Any, h: float, substeps: int, p: Any, out_z: Any, out_v: Any) -> None:
    """March all lanes through the record; row 0 of the outputs is the start.

    z, v (lanes,): start, left at the end of the record.
    nodes (steps, 3): drive at the start, middle and end of each step of `h` [s]; `substeps` steps to a sample.
    p (rows, lanes): coefficients. out_z, out_v (samples, lanes): at the samples.
    """
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
            z1, v1 = z[j], v[j]
            a1 = acceleration(z1, v1, u1, t, p, j)
            held = resistance(v1, a1, p, j)
            a1 -= held
            z2, v2 = z1 + half * v1, v1 + half * a1
            a2 = acceleration(z2, v2, u2, t + half, p, j) - held
            z3, v3 = z1 + half * v2, v1 + half * a2
            a3 = acceleration(z3, v3, u2, t + half, p, j) - held
            z4, v4 = z1 + h * v3, v1 + h * a3
            a4 = acceleration(z4, v4, u4, t + h, p, j) - held
            z[j] = z1 + sixth * (v1 + 2.0 * (v2 + v3) + v4)
            v[j] = v1 + sixth * (a1 + 2.0 * (a2 + a3) + a4)
            note(noted, j, z1, v1, a1, a4, held)
        settle(z, v, noted, h, p)
        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for j in range(lanes):
                out_z[row, j], out_v[row, j] = z[j], v[j]
            row += 1
