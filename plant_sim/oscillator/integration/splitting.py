"""Strang splitting: the damped linear part exactly, with the drive a parabola over the step, and nonlinear kicks.

z'' = gain u - damping z' - stiffness z  |  v <- v - h (quadratic z^2 + cubic z^3 + quintic z^5)

Half a kick, a linear step, half a kick: of order 2, symmetric, and exact to rounding where there is no nonlinear force.
Two half kicks of neighbouring steps are one, so a step costs a quarter of RK4's; only at the samples are they taken
apart. The linear part may be as stiff or as strongly damped as it likes. A template, bound to the nonlinear force.

Reference: Hairer, Lubich, Wanner, Geometric Numerical Integration, II.5; McLachlan, Quispel, Acta Numerica 2002.
"""

from __future__ import annotations

import math
from collections.abc import Set
from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.terms import CUBIC, DAMPING, GAIN, QUADRATIC, QUINTIC, STIFFNESS
from rtctl.border.arrays import FloatArray

KICKS = frozenset({"gain", "damping", "stiffness", "cubic", "quadratic", "quintic"})
"""Terms of the equation that a splitting can take: forces of position alone besides the linear ones."""
_KICK = 10
"""First row of the propagator's h cubic, h quadratic, h quintic."""


@law
def no_kick(z: float, e: Any, j: int) -> float:
    """Return 0: a linear oscillator."""
    return 0.0


@law
def cubic_kick(z: float, e: Any, j: int) -> Any:
    """Return h cubic z^3 of lane `j`."""
    return (e[_KICK, j] * z) * (z * z)


@law
def elastic_kick(z: float, e: Any, j: int) -> Any:
    """Return h (quadratic z^2 + cubic z^3 + quintic z^5)."""
    zz = z * z
    return (e[_KICK + 1, j] + z * (e[_KICK, j] + e[_KICK + 2, j] * zz)) * zz


def kick_for(terms: Set[str]) -> Any:
    """Return the cheapest kick that has the nonlinear ones among `terms`."""
    if terms & {"quadratic", "quintic"}:
        return elastic_kick
    return cubic_kick if "cubic" in terms else no_kick


kick: Any = cubic_kick  # replaced by `bind`


def splitting(z: Any, v: Any, nodes: Any, substeps: int, e: Any, out_z: Any, out_v: Any) -> None:
    """March all lanes through the record as `rk4` does; e (rows, lanes): `propagator`, which knows the step."""
    lanes = z.shape[0]
    for j in range(lanes):
        out_z[0, j], out_v[0, j] = z[j], v[j]
        v[j] -= 0.5 * kick(z[j], e, j)
    row, until_sample = 1, substeps
    for i in range(nodes.shape[0]):
        u1, u2, u4 = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        for j in range(lanes):
            z1, v1 = z[j], v[j]
            z2 = (e[4, j] * u1 + e[5, j] * u2 + e[6, j] * u4 + e[0, j] * z1) + e[1, j] * v1
            v2 = (e[7, j] * u1 + e[8, j] * u2 + e[9, j] * u4 + e[2, j] * z1) + e[3, j] * v1
            z[j], v[j] = z2, v2 - kick(z2, e, j)
        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for j in range(lanes):
                out_z[row, j], out_v[row, j] = z[j], v[j] + 0.5 * kick(z[j], e, j)
            row += 1
    for j in range(lanes):
        v[j] += 0.5 * kick(z[j], e, j)


def acceleration(rows: FloatArray, z: FloatArray, v: FloatArray, u: FloatArray) -> FloatArray:
    """Return z'' (samples, lanes) of motions (samples, lanes) under a drive u (samples,); rows (rows, lanes)."""
    with np.errstate(invalid="ignore", over="ignore"):  # of a motion that diverged
        elastic = rows[STIFFNESS] + z * (rows[QUADRATIC] + z * (rows[CUBIC] + z * z * rows[QUINTIC]))
        felt: FloatArray = u[:, None] * rows[GAIN] - rows[DAMPING] * v - elastic * z
    return felt


def propagator(rows: FloatArray, h: float) -> FloatArray:
    """Return the propagator (13, lanes): d(z, v)/d(z, v) row by row, weights of the drive, kicks.

    The weights are z's and v's of the drive at start, middle and end. From the exponential of the linear part with a
    parabola's three coefficients as further states: no formula that would have to be another one where the damping is
    critical or the stiffness zero. Velocity is scaled by the frequency there, so that the matrix is no larger than the
    angle it turns by.
    """
    lanes = rows.shape[1]
    rate = np.maximum(np.sqrt(np.abs(rows[STIFFNESS])), 1e-3 / h)
    generator = np.zeros((lanes, 5, 5))
    generator[:, 0, 1] = h * rate
    generator[:, 1, 0], generator[:, 1, 1] = -h * rows[STIFFNESS] / rate, -h * rows[DAMPING]
    generator[:, 1, 2] = generator[:, 2, 3] = generator[:, 3, 4] = 1.0  # u, du/ds, d2u/ds2 over s = t / h
    exponential = _exponential(generator)
    weights = exponential[:, :2, 2:] @ _TAYLOR * (h * rows[GAIN] / rate)[:, None, None]
    scale = np.stack([np.ones(lanes), rate], axis=1)
    linear = exponential[:, :2, :2] * scale[:, :, None] / scale[:, None, :]
    weights *= scale[:, :, None]
    kicks = h * rows[[CUBIC, QUADRATIC, QUINTIC]]
    return np.ascontiguousarray(np.vstack([linear.reshape(lanes, 4).T, weights.reshape(lanes, 6).T, kicks]))


_TAYLOR = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [4.0, -8.0, 4.0]])
"""Matrix: u, u', u'' at the start of a parabola from its values at start, middle and end."""


def _exponential(matrices: FloatArray) -> FloatArray:
    """Return the exponential of each of `matrices` (n, k, k).

    Taylor's series below norm 1, then squared; all at once, unlike SciPy's.
    """
    norm = float(np.abs(matrices).sum(axis=2).max(initial=0.0))
    squarings = max(0, math.ceil(math.log2(norm))) if norm > 0.0 else 0
    scaled = matrices / 2.0**squarings
    result = np.broadcast_to(np.eye(matrices.shape[1]), matrices.shape).copy()
    for k in range(_TERMS, 0, -1):
        result = np.eye(matrices.shape[1]) + scaled @ result / k
    for _ in range(squarings):
        result = result @ result
    return result


_TERMS = 19
"""Terms of a series: 1 / 20! is 4e-19."""
