"""Textbook transcriptions without numba: the paper's equations line by line, and relays one at a time."""

from __future__ import annotations

import math

import numpy as np


def generalised_play(v, w, gamma_R, gamma_L, r):
    """Eqs. 3-4 as printed, with the direction test; `w` is the output at v[0]."""
    outputs = [w]
    for last, now in zip(v[:-1], v[1:], strict=True):
        if now > last:
            w = max(gamma_R(now) - r, w)
        elif now < last:
            w = min(gamma_L(now) + r, w)
        outputs.append(w)
    return np.array(outputs)


def classical_play(u, w, r):
    """The same with gamma_R = gamma_L = identity."""
    return generalised_play(u, w, lambda x: x, lambda x: x, r)


def classical_stop(u, s, r):
    """s <- clamp(s + du, -r, r); `s` is the output at u[0]."""
    outputs = [s]
    for du in np.diff(u):
        outputs.append(min(max(outputs[-1] + du, -r), r))
    return np.array(outputs)


def gpi(v, w0, p, r, gamma_R, gamma_L, c):
    """Eq. 6, from the memories w0 at v[0]."""
    plays = [generalised_play(v, w, gamma_R, gamma_L, radius) for w, radius in zip(w0, r, strict=True)]
    return c + sum(weight * w for weight, w in zip(p, plays, strict=True))


def inverse_radii(p, r):
    """Eq. 9 as a double sum, with p_0 r_j in front."""
    return [p[0] * r[j] + sum(p[k] * (r[j] - r[k]) for k in range(1, j)) for j in range(len(p))]


def inverse_weights(p):
    """Eqs. 10-11 with the minus that the transcription of the paper lost."""
    partial = [sum(p[: k + 1]) for k in range(len(p))]
    return [1.0 / p[0]] + [-p[k] / (partial[k] * partial[k - 1]) for k in range(1, len(p))]


def gpi_inverse(y, v0, z0, p, r, heating, cooling, c):
    """Eqs. 7-8 as printed, from the plays z0 at y[0], where v is v0; lines are (a_R, b_R), (a_L, b_L)."""
    radii, weights = inverse_radii(p, r), inverse_weights(p)
    plays = [classical_play(y - c, z, radius) for z, radius in zip(z0, radii, strict=True)]
    u = sum(weight * z for weight, z in zip(weights, plays, strict=True))
    v = [v0]
    for k in range(1, len(y)):
        if y[k] == y[k - 1]:
            v.append(v[-1])
        else:
            a, b = heating if y[k] > y[k - 1] else cooling
            v.append((math.atanh(u[k]) - b) / a)
    return np.array(v)


def relay_grid(v, grid, mu, per_side):
    """Mass that is on, relay by relay, all off at first; `per_side`^2 a cell, no width on the diagonal.

    Relays stand at the middles of equal parts of a cell, so inputs at the parts' borders are summed exactly.
    """
    part = (np.arange(per_side) + 0.5) / per_side
    ups, downs, masses = [], [], []
    for i in range(len(grid) - 1):
        up = grid[i] + part * (grid[i + 1] - grid[i])
        for j in range(i + 1):
            down = grid[j] + part * (grid[j + 1] - grid[j])
            mass = mu[i * (i + 1) // 2 + j]
            pairs = [(x, x) for x in up] if i == j else [(x, z) for x in up for z in down]
            ups += [pair[0] for pair in pairs]
            downs += [pair[1] for pair in pairs]
            masses += [mass / len(pairs)] * len(pairs)
    up, down, mass = np.array(ups), np.array(downs), np.array(masses)
    on = np.zeros(up.size, dtype=bool)
    total = []
    for x in v:
        on = (x >= up) | (on & (x > down))
        total.append(mass[on].sum())
    return np.array(total)
