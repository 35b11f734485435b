"""Force of a mechanism along a motion that was measured: nothing is simulated.

Between two samples the motion is the cubic of their displacements and velocities (Hermite).
"""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.equation.terms import TERMS
from plant_sim.oscillator.forces_of_mechanisms.departures import bound_force
from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.motion import Equation
from rtctl.border.arrays import FloatArray

STEPS = 4
"""Steps in a sample period by which the states of a mechanism follow the motion."""


def mean_forces(own: Equation, nominal: Equation, drive: Driven, z: FloatArray, v: FloatArray) -> FloatArray:
    """Return the mean force per mass (lanes, n - 1) of a mechanism over each sample period of a motion.

    Args:
        own: equation with no mechanism but this, of several lanes.
        nominal: equation without any mechanism, of the same lanes.
        drive: drive, in `STEPS` steps in a sample period.
        z: displacement (n,) at the samples.
        v: velocity (n,) at the samples.
    """
    lanes, step_s = own.rows.shape[1], drive.step_s
    path = *_between(z, v, STEPS * step_s), np.ascontiguousarray(drive.nodes), step_s
    law, states, starts = None, 1, np.zeros((1, lanes))
    for memory in own.memories:  # one at most
        law, states = memory.law, memory.states
        starts = own.own_start(np.full(lanes, z[0]), np.full(lanes, v[0]))
        if memory.step is not None:
            own.rows[len(TERMS) + memory.step] = step_s
    kernel, force = bound_force(law, states), np.empty_like(path[2])
    found = np.empty((lanes, len(z) - 1))
    for lane in range(lanes):
        kernel(*path, own.rows, nominal.rows, lane, starts, force)
        found[lane] = mean_of_steps(force)
    return found


def mean_of_steps(nodes: FloatArray) -> FloatArray:
    """Return the mean (n - 1,) over each sample period of values (steps, 3) at start, middle and end of each step."""
    mean: FloatArray = (nodes @ np.array([1.0, 4.0, 1.0]) / 6.0).reshape(-1, STEPS).mean(axis=1)
    return mean


def _between(z: FloatArray, v: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity (STEPS (n - 1) + 1,) at the ends of all steps."""
    s = np.arange(STEPS) / STEPS
    z0, z1, v0, v1 = z[:-1, None], z[1:, None], period_s * v[:-1, None], period_s * v[1:, None]
    ahead, other = (1.0 + 2.0 * s) * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)
    slopes = s * (1.0 - s) ** 2, s * s * (s - 1.0)
    places = z0 * ahead + z1 * other + v0 * slopes[0] + v1 * slopes[1]
    bend = 6.0 * s * (s - 1.0)
    speeds = (z0 - z1) * bend + v0 * ((1.0 - s) * (1.0 - 3.0 * s)) + v1 * (s * (3.0 * s - 2.0))
    return np.append(places.ravel(), z[-1]), np.append(speeds.ravel() / period_s, v[-1])
