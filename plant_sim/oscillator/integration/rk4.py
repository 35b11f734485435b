"""Runge-Kutta of order 4 at a fixed step, for many parameter sets at once: a template, bound to an acceleration law.

Lanes are the innermost loop, so that the compiler works on eight at a time; one lane costs what a scalar kernel
costs. The drive is given at the three instants of each step that the method needs, which lets it jump between steps.
States of the laws' own move along with displacement and velocity; `bind_rk4` leaves them out of a kernel without any.
Dry friction, whose force jumps with the sign of the velocity, keeps its sign over a step and is corrected after it:
`plant_sim.oscillator.integration.friction`.

The force c(z) z' of a damper that acts at some places alone jumps where the motion reaches them, and a step across such
a jump would be off by its first power. So what is integrated is not the velocity but z' + C(z), where C is the integral
of c over the place (A. Lienard's plane): its rate has no such force in it, and C, the `impulse`, has a kink alone.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1, table 1.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import bind, law
from plant_sim.oscillator.equation.memory import loaded, moved, store
from plant_sim.oscillator.equation.terms import nominal
from plant_sim.oscillator.integration.friction import NOTED, as_it_is, constant, no_resistance, not_noted

acceleration: Any = nominal  # replaced by `bind`, as all of these
ZEROS: Any = (0.0,)  # as many as there are states
load: Any = loaded
move: Any = moved
keep: Any = store
resistance: Any = no_resistance
within: Any = constant
note: Any = not_noted
settle: Any = as_it_is


@law
def no_impulse(z: float, p: Any, j: int) -> Any:
    """Return 0: no damper acts at some places alone."""
    return 0.0


impulse: Any = no_impulse
damping: Any = no_impulse


# 11 parameters because a compiled template takes its arrays one by one
def rk4(  # noqa: PLR0913
    z: Any, v: Any, w: Any, nodes: Any, h: float, substeps: int, p: Any, out_z: Any, out_v: Any,
    acting: Any = None, out_a: Any = None,
) -> None:  # fmt: skip
    """March all lanes through the record; row 0 of the outputs is the start.

    Args:
        z: displacement (lanes,) at the start, left at the end of the record.
        v: velocity (lanes,), likewise.
        w: the laws' own states (states, lanes), likewise.
        nodes: drive (steps, 3) at the start, middle and end of each step.
        h: step [s].
        substeps: steps between two samples.
        p: coefficients (rows, lanes).
        out_z: displacement (samples, lanes) at the samples.
        out_v: velocity (samples, lanes) at the samples.
        acting: drive (samples,) at the samples by which the acceleration is: of two values where it jumps there.
        out_a: acceleration (samples, lanes) at the samples; None: not wanted.
    """
    lanes = z.shape[0]
    half, sixth = 0.5 * h, h / 6.0
    noted = np.empty((NOTED, lanes))
    for j in range(lanes):
        out_z[0, j], out_v[0, j] = z[j], v[j]
        if out_a is not None:
            out_a[0, j] = felt(z[j], v[j], acting[0], 0.0, load(ZEROS, w, j), p, j)
        v[j] += impulse(z[j], p, j)
    row, until_sample = 1, substeps
    for i in range(nodes.shape[0]):
        u1, u2, u4 = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        t = i * h
        for j in range(lanes):
            z1, q1, w1 = z[j], v[j], load(ZEROS, w, j)
            v1 = q1 - impulse(z1, p, j)
            a1, d1 = acceleration(z1, v1, u1, t, w1, p, j)
            held = resistance(v1, a1, p, j)
            a1 -= held
            z2 = z1 + half * v1
            v2 = (q1 + half * a1) - impulse(z2, p, j)
            a2, d2 = acceleration(z2, v2, u2, t + half, move(w1, half, d1), p, j)
            a2 -= within(held, v1, v2, p, j)
            z3 = z1 + half * v2
            v3 = (q1 + half * a2) - impulse(z3, p, j)
            a3, d3 = acceleration(z3, v3, u2, t + half, move(w1, half, d2), p, j)
            a3 -= within(held, v1, v3, p, j)
            z4 = z1 + h * v3
            v4 = (q1 + h * a3) - impulse(z4, p, j)
            a4, d4 = acceleration(z4, v4, u4, t + h, move(w1, h, d3), p, j)
            a4 -= within(held, v1, v4, p, j)
            z[j] = z1 + sixth * (v1 + 2.0 * (v2 + v3) + v4)
            v[j] = q1 + sixth * (a1 + 2.0 * (a2 + a3) + a4)
            note(noted, j, z1, v1, a1, a4, held)
            keep(w, j, move(w1, sixth, move(move(d1, 2.0, move(d2, 1.0, d3)), 1.0, d4)))
        settle(z, v, noted, h, p)
        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for j in range(lanes):
                out_z[row, j], out_v[row, j] = z[j], v[j] - impulse(z[j], p, j)
                if out_a is not None:
                    out_a[row, j] = felt(z[j], out_v[row, j], acting[row], t + h, load(ZEROS, w, j), p, j)
            row += 1
    for j in range(lanes):
        v[j] -= impulse(z[j], p, j)


def acceleration_with_all(z: float, v: float, u: float, t: float, w: Any, p: Any, j: int) -> Any:
    """Return z'' with dry friction and with the dampers that act at some places alone."""
    other = acceleration(z, v, u, t, w, p, j)[0] - damping(z, p, j) * v
    return other - resistance(v, other, p, j)


felt: Any = acceleration_with_all  # compiled by `bind_rk4`, as it needs the laws


settled: Any = as_it_is  # replaced by `bind`


def settle_beside_impulse(z: Any, v: Any, noted: Any, h: float, p: Any) -> None:
    """Put right as `settled`, which takes velocities, the lanes of z' + C(z)."""
    for j in range(len(z)):
        v[j] -= impulse(z[j], p, j)
    settled(z, v, noted, h, p)
    for j in range(len(z)):
        v[j] += impulse(z[j], p, j)


@law
def _load_nothing(zeros: Any, w: Any, j: int) -> float:
    return 0.0


@law
def _move_nothing(w: float, h: float, d: float) -> float:
    return w


@law
def _keep_nothing(w: Any, j: int, values: float) -> None:
    pass


memoryless: Any = nominal  # replaced by `bind`


def without_states(z: float, v: float, u: float, t: float, w: float, p: Any, j: int) -> Any:
    """Return z'' of the law `memoryless`, and a rate of no state."""
    return memoryless(z, v, u, t, p, j), 0.0


def bind_rk4(
    acceleration_law: Any, states: int, impulse_law: Any = None, damping_law: Any = None, **friction: Any
) -> Any:
    """Return `rk4`, compiled for an acceleration law.

    Args:
        acceleration_law: a memoryless law (`plant_sim.oscillator.equation.terms`), or, if there are states, one that
            also returns their rates (`plant_sim.oscillator.equation.memory`).
        states: number of states of the law's own.
        impulse_law: impulse of the dampers that act at some places alone; None: there are none.
        damping_law: their damping.
        friction: `resistance`, `within`, `note` and `settle` of an equation with dry friction.
    """
    rubbing = {key: law_ for key, law_ in friction.items() if key == "resistance"}
    laws: dict[str, Any] = {**friction, "acceleration": acceleration_law}
    if states:
        laws["ZEROS"] = (0.0,) * states
    else:
        laws["acceleration"] = bind(without_states, inline=True, memoryless=acceleration_law)
        laws |= {"load": _load_nothing, "move": _move_nothing, "keep": _keep_nothing}
    if impulse_law is not None:
        laws["impulse"], rubbing["damping"] = impulse_law, damping_law
        if "settle" in friction:
            laws["settle"] = bind(
                settle_beside_impulse, inline=True, settled=friction["settle"], impulse=impulse_law
            )
    laws["felt"] = bind(acceleration_with_all, inline=True, acceleration=laws["acceleration"], **rubbing)
    return bind(rk4, **laws)
