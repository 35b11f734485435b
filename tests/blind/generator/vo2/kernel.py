"""The plant sample by sample: heating -> hysteresis of the grains -> resistance, deflection -> readings.

tau theta' = S - theta,  S = c i^2 (1 + ...) + ...;  phi = sum_j w_j F((p_j - c_j) / s_j), p_j the play of half-width
r_j on temperature (a relay density: return-point memory, no rate). Outputs are taken at t_k, then current k acts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .physics import CREEP_ELEMENTS, FloatArray, Grains, Physics

KELVIN = 273.15
TOLERANCE_K = 1e-6


@njit(cache=True)
def cumulative(x: float, skew: float, median: float) -> float:
    """Skewed logistic distribution function, 1 / (1 + e^-x)^skew with its median moved to 0."""
    return (1.0 + np.exp(-(x + median))) ** (-skew)


@njit(cache=True)
def fraction(T: float, plays: FloatArray, grains: Grains, widening: float) -> float:
    """Metallic fraction if temperature went straight to T; commits nothing."""
    phi = 0.0
    median = -np.log(2.0 ** (1.0 / grains.skew) - 1.0)
    for j in range(plays.size):
        r = grains.half_width[j] * widening
        p = min(max(plays[j], T - r), T + r)
        phi += grains.weight[j] * cumulative((p - grains.centre[j]) / grains.spread[j], grains.skew, median)
    return phi


@njit(cache=True)
def commit(T: float, plays: FloatArray, grains: Grains, widening: float) -> None:
    """Move the plays to temperature T."""
    for j in range(plays.size):
        r = grains.half_width[j] * widening
        plays[j] = min(max(plays[j], T - r), T + r)


@njit(cache=True)
def resistance(T: float, phi: float, p: Physics) -> float:
    """Arrhenius semiconductor and metal, mixed."""
    ln_s = np.log(p.semiconductor) + p.activation * (1.0 / (T + KELVIN) - 1.0 / 298.15)
    ln_m = np.log(p.metal)
    if p.mixing < 1e-6:
        return np.exp((1.0 - phi) * ln_s + phi * ln_m)
    n = p.mixing
    return ((1.0 - phi) * np.exp(-n * ln_s) + phi * np.exp(-n * ln_m)) ** (-1.0 / n)


@njit(cache=True)
def power(i: float, p: Physics) -> float:
    """Heating [K] by the current; a dead band is made up for at the top, so that the range stays."""
    beyond = max(abs(i) - p.deadband, 0.0) * p.top_current / (p.top_current - p.deadband)
    return p.heating * beyond * beyond


@njit(cache=True)
def source(
    theta: float, q: float, ambient: float, plays: FloatArray, grains: Grains, p: Physics, w: float
) -> float:
    """S of tau theta' = S - theta: q, and what is not linear in theta."""
    S = q * (1.0 + p.tcr * theta) / (1.0 + p.tcr * p.top)
    S += theta - theta * (1.0 + p.loss * theta / p.top) / (1.0 + p.loss)
    if p.sense_heat != 0.0 or p.film_power != 0.0:
        T = ambient + theta
        phi = fraction(T, plays, grains, w)
        S += p.sense_heat * resistance(T, phi, p) / p.semiconductor
        S += q * p.film_power * (phi - 1.0)
    return S


@njit(cache=True)
def settled(
    q: float, begin: float, ambient: float, plays: FloatArray, grains: Grains, p: Physics, w: float
) -> float:
    """Static theta at heating q, reached from `begin` in one direction: the nearest root of S = theta."""
    if p.tcr == 0.0 and p.loss == 0.0 and p.sense_heat == 0.0 and p.film_power == 0.0:
        return q
    gap = source(begin, q, ambient, plays, grains, p, w) - begin
    if abs(gap) < TOLERANCE_K:
        return begin
    step = 0.5 if gap > 0.0 else -0.5
    near, f_near = begin, gap
    far, f_far = begin, gap
    for _ in range(400):
        far = near + step
        f_far = source(far, q, ambient, plays, grains, p, w) - far
        if f_far * gap <= 0.0:
            break
        near, f_near = far, f_far
    for _ in range(60):  # false position, Illinois variant
        root = (near * f_far - far * f_near) / (f_far - f_near)
        f = source(root, q, ambient, plays, grains, p, w) - root
        if abs(f) < TOLERANCE_K:
            return root
        if f * f_far <= 0.0:
            near, f_near = far, f_far
        else:
            f_near *= 0.5
        far, f_far = root, f
    return far


@njit(cache=True)
def run(
    p: Physics,
    electric: Grains,
    structural: Grains,
    current: FloatArray,
    ambient: FloatArray,
    dt: float,
    substeps: int,
    twin: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Resistance [ohm], deflection [um] and temperature [deg C] at each sample.

    `twin`: first-order heating of a scalar by i^2 and the device's own static maps after it: what a faultless
    quasi-static identification of this device simulates.
    """
    n = current.size
    R, D, T_out = np.empty(n), np.empty(n), np.empty(n)
    h = dt / substeps
    pe, ps = np.full(electric.weight.size, -1e3), np.full(structural.weight.size, -1e3)
    creep_e, creep_s = np.zeros(CREEP_ELEMENTS), np.zeros(CREEP_ELEMENTS)
    w = 1.0
    square = current[0] * current[0]
    start = power(abs(current[0]), p)
    theta = settled(start, 0.0, ambient[0], pe, electric, p, w)
    slow = p.second_share * theta
    fast = theta - slow
    T = ambient[0] + theta
    T_seen = T
    path = 0.0
    commit(T_seen, pe, electric, w)
    commit(T_seen, ps, structural, w)
    creep_e[:] = fraction(T_seen, pe, electric, w)
    creep_s[:] = fraction(T_seen, ps, structural, w)
    y, v = 0.0, 0.0  # beam, its speed; y starts at the first static deflection
    read = 0.0
    first = True
    omega = 2.0 * np.pi * p.resonance
    dynamic = p.creep > 0.0 or p.sensor_tau > 0.0 or omega > 0.0
    for k in range(n):
        for s in range(substeps + 1):
            if s == substeps or (k == 0 and s == 0) or (s > 0 and dynamic):
                phi_e = fraction(T_seen, pe, electric, w)
                phi_s = fraction(T_seen, ps, structural, w)
                if p.creep > 0.0 and not twin:
                    mean_e, mean_s = 0.0, 0.0
                    for m in range(CREEP_ELEMENTS):
                        forget = 1.0 - np.exp(-h / (p.creep_tau * 3.0**m))
                        creep_e[m] += forget * (phi_e - creep_e[m])
                        creep_s[m] += forget * (phi_s - creep_s[m])
                        mean_e += creep_e[m] / CREEP_ELEMENTS
                        mean_s += creep_s[m] / CREEP_ELEMENTS
                    phi_e += p.creep * (mean_e - phi_e)
                    phi_s += p.creep * (mean_s - phi_s)
                now = resistance(T, phi_e, p)
                rest = p.stroke * phi_s - p.expansion * (T - 25.0)
                if first:
                    y, read, first = rest, now, False
                    before = rest
                read = now if p.sensor_tau == 0.0 or twin else now + (read - now) * np.exp(-h / p.sensor_tau)
                if omega == 0.0 or twin:
                    y = rest
                else:
                    y, v = swing(y, v, before, rest, omega, p.quality, h)
                before = rest
            if s == substeps:
                break
            if s == 0:
                leak = np.sqrt(square) if twin else current[k]
                R[k], D[k], T_out[k] = read + p.crosstalk * leak, y, T
            # one substep of heating
            t = k * dt + s * h
            if twin:
                square += (current[k] * current[k] - square) * (1.0 - np.exp(-h / p.tau))
                theta = settled(power(np.sqrt(square), p), theta, ambient[k], pe, electric, p, w)
            else:
                q = held_power(current, t, h, dt, p)
                near = fast + slow
                S = source(near, q, ambient[k], pe, electric, p, w)
                tau = p.tau * (1.0 + p.slow_cooling) if near > S else p.tau
                middle = near + (S - near) * (1.0 - np.exp(-0.5 * h / tau))
                if near != S:
                    S = source(middle, q, ambient[k], pe, electric, p, w)
                if p.latent > 0.0:
                    move = (S - near) * (1.0 - np.exp(-h / tau))
                    for _ in range(3):
                        if abs(move) < 1e-9:
                            break
                        slope = (
                            fraction(T + move, ps, structural, w) - fraction(T, ps, structural, w)
                        ) / move
                        move = (S - near) * (1.0 - np.exp(-h / (tau * (1.0 + p.latent * slope))))
                    tau = tau * (1.0 + p.latent * slope) if abs(move) >= 1e-9 else tau
                fast += ((1.0 - p.second_share) * S - fast) * (1.0 - np.exp(-h / tau))
                slow += (p.second_share * S - slow) * (1.0 - np.exp(-h / p.second_tau))
                theta = fast + slow
            last = T
            T = ambient[k] + theta
            if p.transition_tau > 0.0 and not twin:
                T_seen += (0.5 * (T + last) - T_seen) * (1.0 - np.exp(-h / p.transition_tau))
            else:
                T_seen = T
            path += abs(T - last)
            w = 1.0 + p.widening * path / (2.0 * p.top)
            commit(T_seen, pe, electric, w)
            commit(T_seen, ps, structural, w)
    return R, D, T_out


@njit(cache=True)
def held_power(current: FloatArray, t: float, h: float, dt: float, p: Physics) -> float:
    """Mean heating over [t, t + h] by the delayed, held current; before the record its first value."""
    begin, end = (t - p.delay) / dt, (t + h - p.delay) / dt
    hum = p.hum * np.sin(2.0 * np.pi * p.hum_hz * (t + 0.5 * h))
    a = int(np.floor(begin + 1e-9))
    b = int(np.floor(end - 1e-9))
    first = power(current[min(max(a, 0), current.size - 1)] + hum, p)
    if a >= b:
        return first
    share = (b - begin) / (end - begin)
    return share * first + (1.0 - share) * power(current[min(max(b, 0), current.size - 1)] + hum, p)


@njit(cache=True)
def swing(
    y: float, v: float, before: float, rest: float, omega: float, quality: float, h: float
) -> tuple[float, float]:
    """Exact step of y'' + omega/Q y' + omega^2 (y - rest) = 0, `rest` going straight from `before` to `rest`."""
    zeta = 0.5 / quality
    slope = (rest - before) / h
    lag = 2.0 * zeta / omega * slope  # the particular solution runs behind the ramp by this
    a, b = y - (before - lag), v - slope
    wd = omega * np.sqrt(1.0 - zeta * zeta)
    decay, c, s = np.exp(-zeta * omega * h), np.cos(wd * h), np.sin(wd * h)
    k = (b + zeta * omega * a) / wd
    free = decay * (a * c + k * s)
    speed = decay * (-zeta * omega * (a * c + k * s) + wd * (k * c - a * s))
    return free + rest - lag, speed + slope
