"""z'' = push - friction, by Runge and Kutta's fourth-order steps that end where a force has a kink.

States y: z, z', relaxing part w, hysteretic part h, second mode q, q', lagged drive, lagged reading. Dry friction keeps
the side to which the mass slides (-1, 1, or 0: it sticks) until the velocity reaches zero; there the force decides.
The arguments of the kernels are many because a compiled kernel allocates nothing and has no state of its own.
"""

from __future__ import annotations

from math import exp, sin, tanh
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from numba import njit

STATES = 8
Z, V, RELAXING, HYSTERETIC, MODE, MODE_RATE, LAGGED_DRIVE, LAGGED_READING = range(STATES)
SEGMENTS = 24  # parts of one step; after so many the rest is taken without a look at kinks
TRIALS = 60  # of the search for a kink in a step
ACCURACY = 1e-12  # of that search, in steps
TINY = 1e-300  # a velocity that has only a sign
BEYOND = 1e12  # displacement of a motion that diverges


class Law(NamedTuple):
    """Coefficients of the equation of motion, in s and in the units of the reading; 0 is absent."""

    damping: float
    stiffness: float
    cubic: float
    gain: float
    quadratic: float = 0.0
    quintic: float = 0.0
    parametric: float = 0.0
    stiffness_drift: float = 0.0  # reached after drift_s
    drift_s: float = 1.0
    drift_settles: float = 0.0  # 1: exponentially, with drift_s as time constant
    relaxing: float = 0.0
    relaxing_s: float = 1.0
    damping_z2: float = 0.0
    damping_v2: float = 0.0
    power: float = 0.0
    exponent: float = 1.0
    sliding: float = 0.0
    breakaway: float = 0.0  # above the sliding level
    stribeck_speed: float = 1.0
    smooth_speed: float = 0.0  # 0: the ideal sign
    hysteretic: float = 0.0
    yielding: float = 1.0  # displacement
    loop: float = 1.0
    order: float = 1.0
    clearance: float = 0.0
    stop_gap: float = 0.0
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    stop_sides: float = 2.0
    gravity: float = 0.0
    mode_gain: float = 0.0
    mode_mass: float = 0.0
    mode_rad_s: float = 0.0
    mode_ratio: float = 0.0
    drive_lag_s: float = 0.0
    reading_lag_s: float = 0.0


@njit(cache=True)
def push(y: Array, t: float, u: float, base: float, law: Law) -> float:
    """Force of unit mass without dry friction."""
    z, v = y[Z], y[V]
    acting = y[LAGGED_DRIVE] if law.drive_lag_s > 0.0 else u
    stiffness = law.stiffness + law.parametric * acting
    if law.stiffness_drift != 0.0 and t > 0.0:
        ramp = 1.0 - exp(-t / law.drift_s) if law.drift_settles > 0.0 else t / law.drift_s
        stiffness += law.stiffness_drift * ramp
    stretched = z - min(max(z, -law.clearance), law.clearance)
    spring = stretched * stiffness + z * z * (law.quadratic + z * (law.cubic + law.quintic * z * z))
    spring += law.gravity * (sin(z) - z)  # a part of the stiffness is that of a weight
    loss = v * (law.damping + law.damping_z2 * z * z + law.damping_v2 * abs(v))
    if law.power != 0.0 and v != 0.0:
        loss += law.power * abs(v) ** law.exponent * (1.0 if v > 0.0 else -1.0)
    if law.stop_stiffness > 0.0:
        if z > law.stop_gap:
            spring += max(law.stop_stiffness * (z - law.stop_gap) + law.stop_damping * v, 0.0)
        elif z < -law.stop_gap and law.stop_sides > 1.5:
            spring += min(law.stop_stiffness * (z + law.stop_gap) + law.stop_damping * v, 0.0)
    force = law.gain * acting - base - spring - loss
    force -= law.relaxing * (z - y[RELAXING]) + law.hysteretic * y[HYSTERETIC]
    if law.mode_mass != 0.0:
        w = law.mode_rad_s
        force += law.mode_mass * (2.0 * law.mode_ratio * w * (y[MODE_RATE] - v) + w * w * (y[MODE] - z))
    return force


@njit(cache=True)
def friction(v: float, law: Law, side: float) -> float:
    """Dry friction of unit mass while the mass slides to `side`."""
    if law.smooth_speed > 0.0:
        return law.sliding * tanh(v / law.smooth_speed)
    ratio = v / law.stribeck_speed
    return side * (law.sliding + law.breakaway * exp(-ratio * ratio))


@njit(cache=True)
def rates(y: Array, t: float, u: float, base: float, law: Law, side: float, dry: bool, dy: Array) -> None:
    """Time derivatives `dy` of all states."""
    z, v = y[Z], y[V]
    if dry and side == 0.0:
        dy[Z] = dy[V] = 0.0
    else:
        dy[Z] = v
        dy[V] = push(y, t, u, base, law) - friction(v, law, side)
    dy[RELAXING] = (z - y[RELAXING]) / law.relaxing_s
    h = y[HYSTERETIC]
    if law.hysteretic != 0.0:
        sign = 1.0 if v * h > 0.0 else (-1.0 if v * h < 0.0 else 0.0)
        dy[HYSTERETIC] = v / law.yielding * (1.0 - (law.loop * sign + 1.0 - law.loop) * abs(h) ** law.order)
    acting = y[LAGGED_DRIVE] if law.drive_lag_s > 0.0 else u
    if law.mode_rad_s > 0.0:
        w, carried = law.mode_rad_s, 1.0 if law.mode_mass != 0.0 else 0.0
        dy[MODE] = y[MODE_RATE]
        dy[MODE_RATE] = law.mode_gain * acting - w * w * (y[MODE] - carried * z)
        dy[MODE_RATE] -= 2.0 * law.mode_ratio * w * (y[MODE_RATE] - carried * v)
    if law.drive_lag_s > 0.0:
        dy[LAGGED_DRIVE] = (u - y[LAGGED_DRIVE]) / law.drive_lag_s
    if law.reading_lag_s > 0.0:
        seen = z + (y[MODE] if law.mode_gain != 0.0 else 0.0)
        dy[LAGGED_READING] = (seen - y[LAGGED_READING]) / law.reading_lag_s


@njit(cache=True)
def between(nodes: Array, place: float) -> float:
    """Value at `place` (0 to 1) of the parabola through start, middle and end of a step."""
    a, b, c = nodes[0], nodes[1], nodes[2]
    return (
        a * (1.0 - place) * (1.0 - 2.0 * place)
        + 4.0 * b * place * (1.0 - place)
        + c * place * (2.0 * place - 1.0)
    )


@njit(cache=True)
def advance(
    y: Array, t: float, h: float, first: float, last: float, u: Array, base: Array, law: Law, side: float,
    dry: bool, work: Array,
) -> None:  # fmt: skip
    """Bring `y` to `work[0]`, from place `first` to `last` of the step that begins at `t` and takes `h`."""
    part, middle = (last - first) * h, 0.5 * (first + last)
    begin, end = t + first * h, t + last * h
    drive, shake = between(u, middle), between(base, middle)
    rates(y, begin, between(u, first), between(base, first), law, side, dry, work[1])
    for i in range(STATES):
        work[0, i] = y[i] + 0.5 * part * work[1, i]
    rates(work[0], 0.5 * (begin + end), drive, shake, law, side, dry, work[2])
    for i in range(STATES):
        work[0, i] = y[i] + 0.5 * part * work[2, i]
    rates(work[0], 0.5 * (begin + end), drive, shake, law, side, dry, work[3])
    for i in range(STATES):
        work[0, i] = y[i] + part * work[3, i]
    rates(work[0], end, between(u, last), between(base, last), law, side, dry, work[4])
    for i in range(STATES):
        work[0, i] = y[i] + part / 6.0 * (work[1, i] + 2.0 * (work[2, i] + work[3, i]) + work[4, i])


@njit(cache=True)
def kink(y: Array, force: float, law: Law, which: int) -> float:
    """Number that changes its sign at a kink: of the velocity, of the four edges, of a mass that sticks."""
    if which == 0:
        return y[V]
    if which == 1:
        return y[Z] - law.clearance
    if which == 2:
        return y[Z] + law.clearance
    if which == 3:
        return y[Z] - law.stop_gap
    if which == 4:
        return y[Z] + law.stop_gap
    return law.sliding + law.breakaway - abs(force)


@njit(cache=True)
def crossing(
    y: Array, t: float, h: float, first: float, u: Array, base: Array, law: Law, side: float, dry: bool,
    work: Array, which: int, before: float, after: float,
) -> float:  # fmt: skip
    """Place in the step just behind the kink `which`, by the false position that never stays (Illinois)."""
    low, high, kept = first, 1.0, 0
    for _ in range(TRIALS):
        if high - low < ACCURACY:
            break
        place = (low * after - high * before) / (after - before)
        place = min(max(place, low + 0.01 * ACCURACY), high - 0.01 * ACCURACY)
        advance(y, t, h, first, place, u, base, law, side, dry, work)
        force = push(work[0], t + place * h, between(u, place), between(base, place), law)
        value = kink(work[0], force, law, which)
        if (value < 0.0) == (before < 0.0) and value != 0.0:
            low, before = place, value
            after = 0.5 * after if kept == 1 else after
            kept = 1
        else:
            high, after = place, value
            before = 0.5 * before if kept == -1 else before
            kept = -1
            if value == 0.0:
                break
    return high


@njit(cache=True)
def first_kink(
    y: Array, t: float, h: float, first: float, u: Array, base: Array, law: Law, side: float, dry: bool,
    active: tuple[bool, ...], work: Array,
) -> tuple[float, int]:  # fmt: skip
    """Place and number of the first kink on the way that `work[0]` ends; (1, -1) if there is none."""
    begins = push(y, t + first * h, between(u, first), between(base, first), law)
    ends, at_end = work[0].copy(), push(work[0], t + h, u[2], base[2], law)
    sticks, last, found = dry and side == 0.0, 1.0, -1
    for which in range(6):
        if (which == 5) != sticks or (which < 5 and not active[which]):
            continue
        before, after = kink(y, begins, law, which), kink(ends, at_end, law, which)
        if which == 0 and dry and before == 0.0:
            before = side * TINY  # it has just begun to slide
        if before < 0.0 < after or before > 0.0 > after:
            place = crossing(y, t, h, first, u, base, law, side, dry, work, which, before, after)
            if place < last:
                last, found = place, which
    return last, found


@njit(cache=True)
def take_step(
    y: Array, t: float, h: float, u: Array, base: Array, law: Law, side: float, dry: bool,
    active: tuple[bool, ...], work: Array,
) -> float:  # fmt: skip
    """Bring `y` to the end of the step that begins at `t`; returns the side to which the mass slides then."""
    kinked = active[0] or active[1] or active[3]
    first, level = 0.0, law.sliding + law.breakaway
    for segment in range(SEGMENTS if kinked else 1):
        if dry and side == 0.0:
            force = push(y, t + first * h, between(u, first), between(base, first), law)
            side = np.sign(force) if abs(force) >= level else 0.0
        advance(y, t, h, first, 1.0, u, base, law, side, dry, work)
        last, found = 1.0, -1
        if kinked and segment < SEGMENTS - 1:
            last, found = first_kink(y, t, h, first, u, base, law, side, dry, active, work)
            advance(y, t, h, first, last, u, base, law, side, dry, work)
        y[:] = work[0]
        if dry and (found == 0 or found == 5):
            force = push(y, t + last * h, between(u, last), between(base, last), law)
            y[V] = 0.0
            side = np.sign(force) if found == 5 or abs(force) >= level else 0.0
        if last >= 1.0:
            break
        first = last
    return side


@njit(cache=True)
def run(
    law: Law, drive: Array, base: Array, h: float, t: float, y: Array, every: int, restarts: Array
) -> Array:
    """States z, z', q and lagged reading at the edges of all steps: an array (steps + 1, 4).

    `drive`, `base`: values at start, middle and end of each step, (steps, 3); `t` [s]: of the first step; `y`: first
    states. `every` > 0: after so many steps z and z' begin anew at rows of `restarts`. NaN from where it diverges.
    """
    steps = drive.shape[0]
    out = np.full((steps + 1, 4), np.nan)
    dry = (law.sliding + law.breakaway > 0.0) and law.smooth_speed == 0.0
    stops = law.stop_stiffness > 0.0
    active = (
        dry or law.damping_v2 != 0.0 or law.power != 0.0 or law.hysteretic != 0.0,
        law.clearance > 0.0,
        law.clearance > 0.0,
        stops,
        stops and law.stop_sides > 1.5,
    )
    y, work = y.copy(), np.zeros((5, STATES))
    side = np.sign(y[V])
    for k in range(steps + 1):
        if every > 0 and k % every == 0 and k < steps:
            y[Z], y[V] = restarts[k, 0], restarts[k, 1]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = y[Z], y[V], y[MODE], y[LAGGED_READING]
        if k == steps or not abs(y[Z]) < BEYOND:
            return out
        side = take_step(y, t + k * h, h, drive[k], base[k], law, side, dry, active, work)
    return out
