"""theta'' = torque - friction, by Dormand and Prince's pairs of order 5(4) whose steps shrink to an error's bound.

States y: theta, theta', two relaxing parts, hysteretic part, second mode q, q', lagged drive. A step never goes past an
edge of its piece of the drive, nor past the instant in which dry friction stops the bar or lets it go; other kinks are
left to the bound on the error. Dormand and Prince (1980), J. Comput. Appl. Math. 6, 19.
"""

from __future__ import annotations

from math import exp, sin, sqrt

import numpy as np
from foreign_common import Array
from foreign_oscillator_motion import Law
from numba import njit

STATES = 8
ANGLE, RATE, FAST, SLOW, HYSTERETIC, MODE, MODE_RATE, LAGGED = range(STATES)
BOUND = 1e-6  # of a step's error, in the scales of the states
SMALLEST = 1e-7  # step, in pieces of the drive; it is taken as it is
MOST = 1000  # steps of a piece; a motion that needs more is taken for one that diverges
HALVINGS = 50  # of the search for an event
BEYOND = 3e3  # angle of a motion that diverges, in its scale
SPREAD = 2.0  # relaxation times of the fibre: the time over this and times this, half of the modulus each

PLACES = np.array([0.0, 0.2, 0.3, 0.8, 8 / 9, 1.0, 1.0])
STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


@njit(cache=True)
def parabola(nodes: Array, place: float) -> float:
    """Value at `place` (0 to 1) of the parabola through start, middle and end of a piece."""
    bend = 2.0 * (nodes[0] - 2.0 * nodes[1] + nodes[2])
    return float(nodes[0] + place * (nodes[2] - nodes[0] + bend * (place - 1.0)))


@njit(cache=True)
def torque(y: Array, t: float, u: float, base: float, law: Law) -> float:
    """Torque over the moment of inertia [rad/s^2], without dry friction."""
    z, v = y[ANGLE], y[RATE]
    acting = y[LAGGED] if law.drive_lag_s > 0.0 else u
    fibre = law.stiffness + law.parametric * acting
    if t > 0.0:
        grown = 1.0 - exp(-t / law.drift_s) if law.drift_settles > 0.0 else t / law.drift_s
        fibre += law.stiffness_drift * grown
    twist = z if law.clearance == 0.0 else np.sign(z) * max(abs(z) - law.clearance, 0.0)
    total = law.gain * acting - base - fibre * twist
    total -= law.quadratic * z**2 + law.cubic * z**3 + law.quintic * z**5 + law.gravity * (sin(z) - z)
    total -= law.damping * v + law.damping_z2 * z**2 * v + law.damping_v2 * abs(v) * v
    if law.power != 0.0:
        total -= law.power * abs(v) ** law.exponent * np.sign(v)
    if law.stop_stiffness > 0.0 and (abs(z) if law.stop_sides > 1.5 else z) > law.stop_gap:
        deep, side = abs(z) - law.stop_gap, np.sign(z)  # Hunt and Crossley: the loss grows with the depth
        loss = 20.0 * law.stop_damping / law.stop_gap
        total -= side * deep * max(law.stop_stiffness + loss * side * v, 0.0)
    total -= law.relaxing * (z - 0.5 * (y[FAST] + y[SLOW])) + law.hysteretic * y[HYSTERETIC]
    if law.mode_mass > 0.0:
        w = law.mode_rad_s
        total -= law.mode_mass * w * (w * (z - y[MODE]) + 2.0 * law.mode_ratio * (v - y[MODE_RATE]))
    return float(total)


@njit(cache=True)
def friction(v: float, law: Law, side: float) -> float:
    """Dry friction over the moment of inertia while the bar slides to `side`."""
    if law.smooth_speed > 0.0:
        return law.sliding * v / sqrt(v * v + law.smooth_speed**2)
    return side * (law.sliding + law.breakaway * exp(-abs(v) / law.stribeck_speed))


@njit(cache=True)
def rates(y: Array, t: float, u: float, base: float, law: Law, stuck: bool, side: float, dy: Array) -> None:
    """Time derivatives `dy` of all states."""
    z, v, h, w = y[ANGLE], y[RATE], y[HYSTERETIC], law.mode_rad_s
    acting = y[LAGGED] if law.drive_lag_s > 0.0 else u
    dy[ANGLE] = 0.0 if stuck else v
    dy[RATE] = 0.0 if stuck else torque(y, t, u, base, law) - friction(v, law, side)
    dy[FAST] = (z - y[FAST]) * SPREAD / law.relaxing_s
    dy[SLOW] = (z - y[SLOW]) / (SPREAD * law.relaxing_s)
    if law.hysteretic > 0.0:
        towards = law.loop * np.sign(v * h) + 1.0 - law.loop
        dy[HYSTERETIC] = v / law.yielding * (1.0 - towards * abs(h) ** law.order)
    if w > 0.0:
        carried = 1.0 if law.mode_mass > 0.0 else 0.0
        pull = w * w * (carried * z - y[MODE]) + 2.0 * law.mode_ratio * w * (carried * v - y[MODE_RATE])
        dy[MODE], dy[MODE_RATE] = y[MODE_RATE], pull + law.mode_gain * acting
    if law.drive_lag_s > 0.0:
        dy[LAGGED] = (u - y[LAGGED]) / law.drive_lag_s


@njit(cache=True)
def try_step(
    y: Array, t: float, h: float, place: float, step: float, u: Array, base: Array, law: Law, stuck: bool,
    side: float, scale: Array, k: Array, new: Array,
) -> float:  # fmt: skip
    """Bring `y` to `new`, `step` (of a piece that takes `h`) on from `place`; returns the error over its bound."""
    for stage in range(7):
        for i in range(STATES):
            total = 0.0
            for j in range(stage):
                total += STAGES[stage, j] * k[j, i]
            new[i] = y[i] + step * h * total
        at = place + step * PLACES[stage]
        rates(new, t + at * h, parabola(u, at), parabola(base, at), law, stuck, side, k[stage])
    worst = 0.0
    for i in range(STATES):
        off = 0.0
        for j in range(7):
            off += ERROR[j] * k[j, i]
        worst = max(worst, abs(step * h * off) / (BOUND * scale[i]))
    return worst


@njit(cache=True)
def rest_place(before: float, after: float, slope: float, slope_after: float) -> float:
    """Place (0 to 1) of the zero of the cubic with these ends and slopes; the ends differ in sign."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        x = 0.5 * (low + high)
        c, d = (
            3.0 * (after - before) - 2.0 * slope - slope_after,
            2.0 * (before - after) + slope + slope_after,
        )
        if (before + x * (slope + x * (c + x * d))) * before > 0.0:
            low = x
        else:
            high = x
    return high


@njit(cache=True)
def go_on(
    y: Array, t: float, h: float, u: Array, base: Array, law: Law, side: float, dry: bool, scale: Array,
    k: Array, new: Array,
) -> float:  # fmt: skip
    """Bring `y` to the end of the piece that begins at `t`; returns the side to which the bar slides then, or 0."""
    place, step, level = 0.0, 1.0, law.sliding + law.breakaway
    for _ in range(MOST):
        if dry and side == 0.0:
            pull = torque(y, t + place * h, parabola(u, place), parabola(base, place), law)
            side = np.sign(pull) if abs(pull) > level else 0.0
        stuck, step = dry and side == 0.0, min(step, 1.0 - place)
        wrong = try_step(y, t, h, place, step, u, base, law, stuck, side, scale, k, new)
        if wrong > 1.0 and step > SMALLEST:
            step *= max(0.9 * wrong**-0.2, 0.1)
            continue
        if stuck:
            end = place + step
            pull = torque(new, t + end * h, parabola(u, end), parabola(base, end), law)
            if (
                abs(pull) > level and step > SMALLEST
            ):  # it breaks away in this step: halve until at its instant
                step *= 0.5
                continue
        elif dry and new[RATE] * side < 0.0:
            if y[RATE] * side > 0.0:
                part = step * rest_place(y[RATE], new[RATE], step * h * k[0, RATE], step * h * k[6, RATE])
                try_step(y, t, h, place, part, u, base, law, False, side, scale, k, new)
                step = part
            elif step > SMALLEST:  # it has just begun to slide
                step *= 0.5
                continue
            new[RATE], side = 0.0, 0.0
        y[:] = new
        place += step
        if place >= 1.0 - 1e-12:
            return side
        step *= min(0.9 * max(wrong, 1e-6) ** -0.2, 4.0) if step > SMALLEST else 4.0
    y[ANGLE] = np.nan
    return side


@njit(cache=True)
def swing(law: Law, drive: Array, base: Array, h: float, t: float, y: Array, scale: Array) -> Array:
    """theta, theta' and q at the edges of all pieces, (pieces + 1, 3); NaN from where the motion diverges.

    `drive`, `base`: at start, middle and end of each piece, (pieces, 3); `h` [s]: a piece; `t` [s]: start of the first;
    `y`: first states; `scale`: sizes of the states to which errors are compared.
    """
    pieces = drive.shape[0]
    out, k, new = np.full((pieces + 1, 3), np.nan), np.zeros((7, STATES)), np.zeros(STATES)
    dry = law.sliding + law.breakaway > 0.0 and law.smooth_speed == 0.0
    y, side = y.copy(), np.sign(y[RATE])
    for n in range(pieces + 1):
        out[n, 0], out[n, 1], out[n, 2] = y[ANGLE], y[RATE], y[MODE]
        if n == pieces or not abs(y[ANGLE]) < BEYOND * scale[ANGLE]:
            break
        side = go_on(y, t + n * h, h, drive[n], base[n], law, side, dry, scale, k, new)
    return out
