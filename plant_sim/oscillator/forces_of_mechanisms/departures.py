"""What a mechanism that a model lacks would do to its motion, to the first order in its amplitude.

A small force f of the mechanism, as it would be along the motion without it, acts as the drive f / gain does. So the
kernel of the model itself gives the departure: the equation with the mechanism is another kernel for each pair of
mechanisms, which would take seconds to compile and serve for this alone.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import bind
from plant_sim.oscillator.equation.memory import combined, loaded, moved
from plant_sim.oscillator.equation.terms import GAIN, TERMS, polynomial
from plant_sim.oscillator.integration.friction import sliding
from plant_sim.oscillator.integration.steps import Plan
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism
from plant_sim.oscillator.motion import Equation
from rtctl.border.arrays import FloatArray

law: Any = None  # replaced by `bind`, as ZEROS
ZEROS: Any = (0.0,)


# 9 parameters because a compiled template takes its arrays one by one
def force_along(z: Any, v: Any, nodes: Any, h: float, p: Any, p0: Any, j: int, w0: Any, out: Any) -> None:  # noqa: PLR0913
    """Follow the force of a mechanism along a motion.

    Args:
        z: displacement (steps + 1,) at the ends of the steps.
        v: velocity, likewise.
        nodes: drive (steps, 3) at the start, middle and end of each step.
        h: step [s].
        p: coefficients (rows, lanes) of the nominal model and the mechanism.
        p0: those of the nominal model.
        j: lane.
        w0: states (states, lanes) of the mechanism at the start.
        out: force per mass (steps, 3) at the start, middle and end of each step, out.
    """
    half, sixth, w = 0.5 * h, h / 6.0, loaded(ZEROS, w0, j)
    for i in range(nodes.shape[0]):
        t, u1, u2, u4 = i * h, nodes[i, 0], nodes[i, 1], nodes[i, 2]
        z1, v1, z4, v4 = z[i], v[i], z[i + 1], v[i + 1]
        z2 = 0.5 * (z1 + z4) + 0.125 * h * (v1 - v4)
        v2 = 1.5 * (z4 - z1) / h - 0.25 * (v1 + v4)
        a1, d1 = law(z1, v1, u1, t, w, p, j)
        _, d2 = law(z2, v2, u2, t + half, moved(w, half, d1), p, j)
        a3, d3 = law(z2, v2, u2, t + half, moved(w, half, d2), p, j)
        a4, d4 = law(z4, v4, u4, t + h, moved(w, h, d3), p, j)
        out[i, 0] = a1 - polynomial(z1, v1, u1, t, p0, j) - np.sign(v1) * sliding(v1, p, j)
        out[i, 1] = a3 - polynomial(z2, v2, u2, t + half, p0, j) - np.sign(v2) * sliding(v2, p, j)
        out[i, 2] = a4 - polynomial(z4, v4, u4, t + h, p0, j) - np.sign(v4) * sliding(v4, p, j)
        w = moved(w, sixth, moved(moved(d1, 2.0, moved(d2, 1.0, d3)), 1.0, d4))


def without_memory(z: float, v: float, u: float, t: float, w: Any, p: Any, j: int) -> Any:
    """Return z'' of a mechanism without states, and no rate of any."""
    return polynomial(z, v, u, t, p, j), w


class Departure:
    """A mechanism beside an equation without it, along whose motion its force is taken."""

    def __init__(
        self, equation: Equation, drive: Driven, start: FloatArray, nominal: Equation, own: Equation
    ) -> None:
        """Follow the motion once.

        Args:
            equation: equation without the mechanism, one lane.
            drive: its drive.
            start: displacement and velocity (1, 2) at the start.
            nominal: equation without any mechanism, a lane for each departure.
            own: equation with no mechanism but this, likewise.
        """
        self._drive, self._gain = drive, equation.rows[GAIN, 0]
        z, v = equation.integrate(drive, Plan(1, False), start)
        self._path = z[0], v[0], drive.nodes, drive.step_s
        self._rows, self._nominal_rows = own.rows, nominal.rows
        lanes = own.rows.shape[1]
        self._law, states = None, 1
        self._states = np.zeros((1, lanes))
        for memory in own.memories:  # one at most
            self._law, states = memory.law, memory.states
            self._states = own.own_start(np.full(lanes, start[0, 0]), np.full(lanes, start[0, 1]))
            if memory.step is not None:
                self._rows[len(TERMS) + memory.step] = drive.step_s
        self._kernel = bound_force(self._law, states)

    def pushed(self, lane: int) -> Driven:
        """Return the drive under which the equation departs as the mechanism of a lane makes it."""
        force = np.empty_like(self._drive.nodes)
        self._kernel(*self._path, self._rows, self._nominal_rows, lane, self._states, force)
        return self._drive._replace(nodes=self._drive.nodes + force / self._gain)


def acts_as_a_force(mechanism: OscillatorMechanism, equation: Equation, own: Equation) -> bool:
    """Return whether a mechanism's departure is worth taking from its force, and can be.

    Not worth it is where the equation has neither memory nor dry friction: the kernel with both is needed anyway then.

    Args:
        mechanism: the mechanism.
        equation: equation of the model without it.
        own: equation with no mechanism but this.
    """
    return (
        (bool(equation.memories) or equation.rubs)
        and not mechanism.acts_before_the_equation
        and all(memory.damping is None for memory in own.memories)
        and equation.rows[GAIN, 0] != 0.0
    )


@lru_cache(maxsize=64)
def bound_force(memory_law: Any, states: int) -> Any:
    """Return the compiled `force_along` of a memory law; None: of a mechanism without one."""
    bound = (
        bind(without_memory, inline=True)
        if memory_law is None
        else combined(polynomial, [(memory_law, len(TERMS), states)])
    )
    return bind(force_along, law=bound, ZEROS=(0.0,) * states)
