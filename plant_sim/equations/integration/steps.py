"""The number of steps in a sample from the model's slopes along its motion, and whether they are implicit.

The eigenvalues of the Jacobian at some places of a motion are the model's rates. A rate that turns needs
`STEPS_PER_PERIOD` of Runge-Kutta's steps, one that only decays a twentieth of its time constant. Where that is far more
than the rest of the motion needs, because something decays within a fraction of a sample, implicit steps are taken.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.language.tree import Tree
from plant_sim.equations.system import System, terms_of_outputs, terms_of_rates
from rtctl.border.arrays import FloatArray

STEPS_PER_PERIOD = 256.0
RELAXATION = 0.5
"""A rate that only decays needs the step of a turning one of so many times it."""
IMPLICIT_STEPS_PER_PERIOD = 64.0
IMPLICIT_COST = 20.0
"""Cost of an implicit step, in Runge-Kutta's."""
DECAYED = 10.0
"""Time constants in a sample period from which on a decaying part is done with before the next sample."""
MOST_SUBSTEPS = 100_000
MOST_STEPS = 40_000_000
"""Most steps of one record: 24 bytes each for every input."""
SHARES = (1e-7, 1e-4, 1e-2)
"""Steps of finite differences as shares of a state's swing, see `slopes`."""
SMOOTH = 3.0
"""Ratio of slopes over the first two steps below which a rate is smooth there."""
FARTHEST = 1e30
"""Value [SI] of a state beyond which a motion is lost and its slopes say nothing."""
PLACES = 24
"""Places along a motion at which the slopes are taken, besides its turning points."""


class Plan(NamedTuple):
    """How to integrate a record."""

    substeps: int
    implicit: bool
    tolerance: float = 0.0
    """Above 0: implicit steps are divided as the motion needs, to errors of this share of a state's size."""


class Places(NamedTuple):
    """Places of a motion: states (m, states), inputs (m, inputs), times (m,), all SI."""

    x: FloatArray
    u: FloatArray
    t: FloatArray


def places_of(x: FloatArray, u: FloatArray, period_s: float) -> Places:
    """Return places of a motion, with its extremes; those that are not finite are left out.

    Args:
        x: States (samples, states).
        u: Inputs (samples, inputs).
        period_s: Sample period [s].
    """
    with np.errstate(invalid="ignore"):
        whole = np.flatnonzero((np.abs(x) < FARTHEST).all(axis=1))
    if len(whole) == 0:
        whole = np.zeros(1, dtype=np.intp)
    x, u = x[whole], u[whole]
    n = len(whole)
    chosen = set(np.linspace(0, n - 1, min(PLACES, n)).astype(int).tolist())
    for column in (*x.T, *np.diff(x, axis=0).T, *u.T):
        if len(column):
            chosen |= {int(np.argmin(column)), int(np.argmax(column))}
    rows = np.array(sorted(chosen))
    return Places(x[rows], u[rows], period_s * whole[rows].astype(np.float64))


def values_at(
    system: System, places: Places, p: FloatArray, terms: Mapping[str, Tree]
) -> dict[str, FloatArray]:
    """Return the numbers [SI] of all names, `terms` among them, at places with parameters `p` (parameters,)."""
    values: dict[str, FloatArray] = {TIME: places.t}
    values |= {one.name: places.x[:, k] for k, one in enumerate(system.states)}
    values |= {one.name: places.u[:, k] for k, one in enumerate(system.inputs)}
    values |= {one.name: p[k] for k, one in enumerate(system.parameters)}
    for name, tree in terms.items():
        values[name] = evaluate(tree, values)
    return values


def rates_at(system: System, places: Places, p: FloatArray) -> FloatArray:
    """Return the rates (m, states) [SI] at places with parameters `p` (parameters,)."""
    values = values_at(system, places, p, terms_of_rates(system))
    rates = (evaluate(one.rate, values) for one in system.states)
    return np.stack([np.broadcast_to(rate, places.t.shape) for rate in rates], axis=1)


def outputs_at(system: System, places: Places, p: FloatArray) -> FloatArray:
    """Return the outputs (m, outputs), each in its unit, at places with parameters `p` (parameters,)."""
    values = values_at(system, places, p, terms_of_outputs(system))
    outputs = (evaluate(one.value, values) / one.factor for one in system.outputs)
    return np.stack([np.broadcast_to(one, places.t.shape) for one in outputs], axis=1)


def slopes(system: System, places: Places, p: FloatArray, swing: FloatArray) -> FloatArray:
    """Return the Jacobians (m, states, states) at places.

    A slope is that over a small step where the rate is smooth; at a jump or a root's zero that would be without
    bound, and what the motion feels is the slope over a hundredth of its swing.

    Args:
        system: The model.
        places: Where.
        p: Parameters (parameters,) [SI].
        swing: Sizes (states,) of the states' motions [SI].
    """
    m, n = places.x.shape
    base = rates_at(system, places, p)
    moved = np.tile(places.x, (len(SHARES) * n, 1)).reshape(len(SHARES), n, m, n)
    steps = np.outer(SHARES, swing)
    for k in range(n):
        moved[:, k, :, k] += steps[:, k, None]
    times = len(SHARES) * n
    there = Places(moved.reshape(-1, n), np.tile(places.u, (times, 1)), np.tile(places.t, times))
    with np.errstate(all="ignore"):
        change = rates_at(system, there, p).reshape(len(SHARES), n, m, n) - base
        tiny, small, large = change / steps[:, :, None, None]
    smooth = np.abs(tiny) <= SMOOTH * np.abs(small) + 1e-300
    found = np.where(smooth, small, large)
    return np.ascontiguousarray(np.nan_to_num(found.transpose(1, 2, 0), posinf=0.0, neginf=0.0))


def plan(jacobians: FloatArray, period_s: float, steps_per_period: float | None) -> Plan:
    """Return the method and its steps between two samples.

    Args:
        jacobians: Slopes (m, states, states) [1/s] along the motion.
        period_s: Sample period [s].
        steps_per_period: Runge-Kutta steps in a period of the fastest turning rate; None: so many that their error is
            negligible.

    Raises:
        ValueError: No sensible step resolves the model.
    """
    found = np.linalg.eigvals(jacobians)
    size = np.maximum(np.abs(found.imag), RELAXATION * np.abs(found))
    gone = (found.real < -np.abs(found.imag)) & (np.abs(found) * period_s > DECAYED)
    periods = period_s / (2.0 * math.pi)
    explicit = periods * float(size.max(initial=0.0)) * (steps_per_period or STEPS_PER_PERIOD)
    rest = float(size[~gone].max(initial=0.0))
    implicit = max(1.0, periods * rest * IMPLICIT_STEPS_PER_PERIOD)
    if gone.any() and IMPLICIT_COST * implicit < explicit:
        return Plan(_rounded(implicit), True)
    if not explicit <= MOST_SUBSTEPS:
        fastest = float(np.abs(found).max())
        raise ValueError(
            f"the model's fastest part, at {fastest:.3g} 1/s, would need {explicit:.3g} steps between two samples "
            f"{period_s:.3g} s apart (at most {MOST_SUBSTEPS}); check the units of its parameters"
        )
    return Plan(_rounded(explicit), False)


def check_work(substeps: int, samples: int) -> None:
    """Raise ValueError where a record's steps would fill the memory: a parameter is absurd, then."""
    if substeps * samples > MOST_STEPS:
        raise ValueError(
            f"{samples} samples of {substeps} steps each, as the model's fastest part needs, are more than a record "
            f"may take ({MOST_STEPS:.0e}); check the units of its parameters"
        )


def _rounded(steps: float) -> int:
    """Return the next larger of 1, 2, 3, 4, 6, 8, 12, 16, ...: small changes of a model leave its steps as they are."""
    power: int = 2 ** max(0, math.ceil(math.log2(max(steps - 1e-9, 1.0))))
    return 3 * power // 4 if power >= 4 and steps <= 3 * power // 4 else power
