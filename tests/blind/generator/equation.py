"""The oscillator with every effect at once, dimensionless: time in 1/omega0, displacement in L, drive in U.

    z'' + (c + cn z^2 + cq |z'| + cu |d|) z' + k (1 + drift t + jump) z + k2 z^2 + k3 z^3 + k5 z^5 + par d z
        + friction sign(z') + bw h + ve e + outside(z, z', t) + coupling(z, q) = g d

An amplitude of zero switches an effect off. State order: z, z', then only the memories in use (see `slots`):
h Bouc-Wen, e Maxwell element, (q, q') second mode, d lagged drive, s lagged reading, f_i fractional elements.
"""

from __future__ import annotations

from enum import IntEnum, auto

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class P(IntEnum):
    """Places of the parameters in the kernel's array."""

    C = 0
    K = auto()
    K2 = auto()
    K3 = auto()
    K5 = auto()
    G = auto()
    PAR = auto()
    DRIFT = auto()
    VE = auto()
    VE_RATE = auto()
    CN = auto()
    CQ = auto()
    FRICTION = auto()
    BW = auto()
    BW_BETA = auto()
    BW_GAMMA = auto()
    MODE_GAIN = auto()
    """Parallel mode: force on it a unit of drive."""
    MODE_MASS = auto()
    """Attached resonator: its mass over the device's."""
    MODE_W2 = auto()
    MODE_C = auto()
    DRIVE_RATE = auto()
    """1/time constant of the drive's lag."""
    SENSOR_RATE = auto()
    STOP = auto()
    STOP_GAP = auto()
    STOP_BOTH = auto()
    """1: stops on both sides; 0: only where z > gap."""
    STOP_CENTRE = auto()
    CBRT = auto()
    FEEDBACK = auto()
    FEEDBACK_TIME = auto()
    RIPPLE = auto()
    RIPPLE_KAPPA = auto()
    EXP = auto()
    EXP_LENGTH = auto()
    CU = auto()
    FRACTIONAL = auto()
    FRACTIONAL_ORDER = auto()
    PLAY = auto()
    """Half of the free play of the spring."""
    PLAY_CENTRE = auto()
    """Its centre over that half."""


N_PARAMETERS = len(P)
FRACTIONAL_RATES = np.logspace(-1.5, 1.5, 7)
CBRT_SMOOTHING = 1e-2  # speed under which the cube root is made linear: its slope at zero is infinite

# numba reads module integers, not enums, fastest
(
    C,
    K,
    K2,
    K3,
    K5,
    G,
    PAR,
    DRIFT,
    VE,
    VE_RATE,
    CN,
    CQ,
    FRICTION,
    BW,
    BW_BETA,
    BW_GAMMA,
    MODE_GAIN,
    MODE_MASS,
) = range(18)
(MODE_W2, MODE_C, DRIVE_RATE, SENSOR_RATE, STOP, STOP_GAP, STOP_BOTH, STOP_CENTRE, CBRT) = range(18, 27)
(FEEDBACK, FEEDBACK_TIME, RIPPLE, RIPPLE_KAPPA, EXP, EXP_LENGTH, CU, FRACTIONAL, FRACTIONAL_ORDER) = range(
    27, 36
)
PLAY, PLAY_CENTRE = 36, 37
S_SIZE, S_H, S_E, S_Q, S_D, S_S, S_F = range(7)


def slots(p: FloatArray) -> NDArray[np.int64]:
    """Number of states, then the place of each memory (-1: not in use)."""
    places = np.full(7, -1, dtype=np.int64)
    size = 2
    wanted = (
        (S_H, p[BW] != 0.0, 1),
        (S_E, p[VE] != 0.0, 1),
        (S_Q, p[MODE_GAIN] != 0.0 or p[MODE_MASS] != 0.0, 2),
        (S_D, p[DRIVE_RATE] != 0.0, 1),
        (S_S, p[SENSOR_RATE] != 0.0, 1),
        (S_F, p[FRACTIONAL] != 0.0, FRACTIONAL_RATES.size),
    )
    for slot, used, count in wanted:
        if used:
            places[slot] = size
            size += count
    places[S_SIZE] = size
    return places


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def static_force(y: float, p: FloatArray) -> float:
    """What pulls back at rest, without the drive; the acceleration is minus this."""
    e = y
    if p[PLAY] != 0.0:
        e = y - min(max(y, p[PLAY] * (p[PLAY_CENTRE] - 1.0)), p[PLAY] * (p[PLAY_CENTRE] + 1.0))
    force = (p[K] + (p[K2] + (p[K3] + p[K5] * e * e) * e) * e) * e
    if p[STOP] != 0.0:
        inside = y - p[STOP_CENTRE]
        if inside > p[STOP_GAP]:
            force += p[STOP] * (inside - p[STOP_GAP])
        elif inside < -p[STOP_GAP] and p[STOP_BOTH] > 0.0:
            force += p[STOP] * (inside + p[STOP_GAP])
    if p[RIPPLE] != 0.0:
        force += p[RIPPLE] * np.sin(p[RIPPLE_KAPPA] * (y - p[STOP_CENTRE]))
    if p[EXP] != 0.0:
        force += p[EXP] * (np.exp((y - p[STOP_CENTRE]) / p[EXP_LENGTH]) - 1.0)
    return force


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def derivative(
    x: FloatArray,
    dx: FloatArray,
    t: float,
    drive: float,
    softer: float,
    delayed: float,
    sign: float,
    stuck: bool,
    p: FloatArray,
    slot: NDArray[np.int64],
) -> float:
    """Fill dx; return the acceleration without dry friction (what friction must hold when stuck).

    `softer` is the momentary relative change of stiffness, `delayed` the displacement a feedback time ago,
    `sign` the direction of sliding; `stuck` freezes z.
    """
    y, v = x[0], x[1]
    d = drive
    if slot[S_D] >= 0:
        d = x[slot[S_D]]
        dx[slot[S_D]] = (drive - d) * p[DRIVE_RATE]
    damping = p[C] + p[CN] * y * y + p[CQ] * abs(v) + p[CU] * abs(d)
    a = p[G] * d - damping * v - static_force(y, p)
    a -= (p[K] * (p[DRIFT] * t + softer) + p[PAR] * d) * y + p[FEEDBACK] * delayed
    if p[CBRT] != 0.0:
        a -= p[CBRT] * v / (v * v + CBRT_SMOOTHING**2) ** (1.0 / 3.0)
    if slot[S_H] >= 0:
        h = x[slot[S_H]]
        a -= p[BW] * h
        dx[slot[S_H]] = v - p[BW_BETA] * abs(v) * h - p[BW_GAMMA] * v * abs(h)
    if slot[S_E] >= 0:
        e = x[slot[S_E]]
        a -= p[VE] * e
        dx[slot[S_E]] = v - p[VE_RATE] * e
    if slot[S_F] >= 0:
        for i in range(FRACTIONAL_RATES.size):
            rate = FRACTIONAL_RATES[i]
            f = x[slot[S_F] + i]
            a -= p[FRACTIONAL] * rate ** p[FRACTIONAL_ORDER] * f
            dx[slot[S_F] + i] = v - rate * f
    seen = y
    if slot[S_Q] >= 0:
        q, qv = x[slot[S_Q]], x[slot[S_Q] + 1]
        dx[slot[S_Q]] = qv
        if p[MODE_MASS] != 0.0:
            pull = p[MODE_C] * (qv - v) + p[MODE_W2] * (q - y)
            a += p[MODE_MASS] * pull
            dx[slot[S_Q] + 1] = -pull
        else:
            dx[slot[S_Q] + 1] = p[MODE_GAIN] * d - p[MODE_C] * qv - p[MODE_W2] * q
            seen = y + q
    if slot[S_S] >= 0:
        dx[slot[S_S]] = (seen - x[slot[S_S]]) * p[SENSOR_RATE]
    if stuck:
        dx[0] = 0.0
        dx[1] = 0.0
    else:
        dx[0] = v
        dx[1] = a - p[FRICTION] * sign
    return a
