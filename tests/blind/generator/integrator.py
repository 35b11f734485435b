"""Dormand and Prince's order 8 with fixed steps; dry friction by events, so that the device truly sticks.

The drive within a step is a cubic through its values at 0, 1/3, 2/3 and 1 of the step: exact for a zero and a linear
hold, 4e-6 of the drive's band edge for a band-limited one. Tableau: Hairer, Norsett, Wanner, *Solving ODE I*, II.5.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import DOP853

from .equation import (
    FEEDBACK,
    FEEDBACK_TIME,
    FRICTION,
    MODE_MASS,
    S_Q,
    S_S,
    S_SIZE,
    FloatArray,
    derivative,
)

STAGES = 12
A = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
B = np.ascontiguousarray(DOP853.B)
NODES = np.ascontiguousarray(DOP853.C[:STAGES])
EVENTS_A_STEP = 8
FAR = 1e3  # beyond this many L the motion has left the device

_TO_CUBIC = np.linalg.inv(np.vander([0.0, 1 / 3, 2 / 3, 1.0], 4, increasing=True))


def cubic_coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of 1, s, s^2, s^3 from values at s = 0, 1/3, 2/3, 1 (last axis)."""
    return np.ascontiguousarray(values @ _TO_CUBIC.T)


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def _past(history: FloatArray, t: float, step: float, known: int) -> float:
    """Displacement at an earlier time, cubic Hermite on the steps done; before the record the device rested."""
    place = t / step
    if place <= 0.0:
        return history[0, 0]
    i = min(int(place), known - 1)
    s = place - i
    y0, v0, y1, v1 = history[i, 0], history[i, 1] * step, history[i + 1, 0], history[i + 1, 1] * step
    return y0 + s * (v0 + s * (3 * (y1 - y0) - 2 * v0 - v1 + s * (2 * (y0 - y1) + v0 + v1)))


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def _step(x, out, work, t, h, begin, end, u, softer, history, known, sign, stuck, p, slot):
    """From fraction `begin` to `end` of a step of length h that began at t; out = state at `end`."""
    size = slot[S_SIZE]
    span = (end - begin) * h
    stage = work[STAGES]
    for i in range(STAGES):
        for n in range(size):
            stage[n] = 0.0
        for j in range(i):
            a = A[i, j]
            if a != 0.0:
                for n in range(size):
                    stage[n] += a * work[j, n]
        for n in range(size):
            stage[n] = x[n] + span * stage[n]
        s = begin + NODES[i] * (end - begin)
        time = t + s * h
        delayed = 0.0
        if p[FEEDBACK] != 0.0:
            delayed = _past(history, time - p[FEEDBACK_TIME], h, known)
        drive = u[0] + s * (u[1] + s * (u[2] + s * u[3]))
        derivative(stage, work[i], time, drive, softer, delayed, sign, stuck, p, slot)
    for n in range(size):
        out[n] = 0.0
    for i in range(STAGES):
        b = B[i]
        if b != 0.0:
            for n in range(size):
                out[n] += b * work[i, n]
    for n in range(size):
        out[n] = x[n] + span * out[n]


@njit(cache=True)
def _copy(source: FloatArray, target: FloatArray, size: int) -> None:
    for n in range(size):  # a slice's assignment costs seconds of compilation
        target[n] = source[n]


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def _advance(x, out, work, t, h, u, softer, history, known, sign, p, slot):
    """One step, split where sliding stops or begins; `sign` 0 means stuck. Returns the sign; the state is in x."""
    size = slot[S_SIZE]
    level = p[FRICTION]
    begin, low, high, end = 0.0, 0.0, 1.0, 1.0
    at_low, at_high = 1.0, -1.0
    events = turns = 0
    while True:
        stuck = level > 0.0 and sign == 0.0
        _step(x, out, work, t, h, begin, end, u, softer, history, known, sign, stuck, p, slot)
        if level == 0.0:
            break
        drive = u[0] + end * (u[1] + end * (u[2] + end * u[3]))
        pull = derivative(out, work[0], t + end * h, drive, softer, 0.0, 0.0, True, p, slot)
        lasts = level - abs(pull) if stuck else out[1] * sign  # negative: the phase ended before `end`
        if events > EVENTS_A_STEP or (end == 1.0 and lasts >= 0.0):
            break
        if lasts >= 0.0:
            low, at_low = end, lasts
        else:
            high, at_high = end, lasts
        turns += 1
        if high - low < 1e-10 or abs(lasts) < 1e-13:
            _copy(out, x, size)
            if stuck:
                sign = 1.0 if pull > 0.0 else -1.0
            else:
                x[1] = 0.0
                sign = 0.0 if abs(pull) <= level else (1.0 if pull > 0.0 else -1.0)
            events += 1
            if events > EVENTS_A_STEP:  # chatter: the rest of the step stuck
                sign = 0.0
            begin, low, high, end, at_low, at_high, turns = end, end, 1.0, 1.0, 1.0, -1.0, 0
            if begin == 1.0:
                return sign
        else:
            part = at_low / (at_low - at_high) if turns % 2 == 0 else 0.5
            end = low + min(max(part, 0.01), 0.99) * (high - low)
    _copy(out, x, size)
    return sign


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def integrate(
    p: FloatArray,
    slot: NDArray[np.int64],
    start: FloatArray,
    drive: FloatArray,
    steps: FloatArray,
    softer: FloatArray,
    displacement: FloatArray,
    velocity: FloatArray,
) -> bool:
    """Integrate one record; False where the motion left the device.

    `drive` (samples - 1, steps a sample, 4) holds cubic coefficients, `steps` the lengths of the steps of a sample,
    `softer` (samples) the relative change of stiffness in each sample. `displacement` and `velocity` are filled
    with what the sensor's front sees at each sample: device and parallel mode, through the sensor's lag.
    """
    size = slot[S_SIZE]
    x = start.copy()
    out = np.zeros(size)
    work = np.zeros((STAGES + 1, size))
    a_sample = steps.size
    history = np.zeros((displacement.size * a_sample + 1 if p[FEEDBACK] != 0.0 else 1, 2))
    history[0, 0] = x[0]
    done = 0
    sign = 0.0
    t_sample = 0.0
    period = steps.sum()
    for k in range(displacement.size):
        y, v = x[0], x[1]
        if slot[S_Q] >= 0 and p[MODE_MASS] == 0.0:
            y += x[slot[S_Q]]
            v += x[slot[S_Q] + 1]
        if slot[S_S] >= 0:
            y = x[slot[S_S]]
        displacement[k] = y
        velocity[k] = v
        if not abs(y) < FAR:
            return False
        if k == displacement.size - 1:
            break
        t_sample = k * period
        t = t_sample
        for j in range(a_sample):
            h = steps[j]
            sign = _advance(x, out, work, t, h, drive[k, j], softer[k], history, done, sign, p, slot)
            done += 1
            if p[FEEDBACK] != 0.0:
                history[done, 0] = x[0]
                history[done, 1] = x[1]
            t += h
    return True
