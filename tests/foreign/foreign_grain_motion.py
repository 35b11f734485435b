"""Compiled steps of a film of grains: two thermal layers in exact steps, grains that switch, resistance of the film.

A layer heated by P [K] feeds the film: tau_l x' = P - x, tau T' = T_room + x - T. Grain i is at
T_room + p_i (T - T_room); its neighbours add J m to that. It turns metallic above `up` and back below `down`.
"""

from __future__ import annotations

from math import exp, log
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from numba import njit

PASSES = 50  # of an avalanche
SEARCH = 60  # steps of the search for a mixture's conductivity


class Heat(NamedTuple):
    """Thermal path and what may be hidden in it; times in s, temperatures in K, 0 is absent."""

    tau: float
    layer: float
    step: float
    ambient: float  # °C
    coupling: float
    slow_share: float = 0.0  # of the heating, with the time constant `slow`
    slow: float = 1.0
    tcr: float = 0.0  # 1/K
    sense: float = 0.0  # by the sense current, cold
    lag: float = 0.0  # of the transition behind the temperature
    latent: float = 0.0


class Film(NamedTuple):
    """What the resistance is made of; a mixture per column, the columns in series."""

    semiconductor: float  # ohm at 25 °C
    activation: float  # K
    metal: float  # ohm
    critical: (
        float  # percolation threshold of the general effective medium; 0: grains of a column in parallel
    )
    low_exponent: float
    high_exponent: float


class Grains(NamedTuple):
    """Grains in the order in which they turn metallic; shares sum to 1."""

    up: Array  # °C
    down: Array
    profile: Array
    falling: Array  # numbers of the grains in the order in which they turn back
    column: Array
    in_column: Array  # share of its column
    electrical: Array  # share of the film
    bends: Array  # share of the deflection


@njit(cache=True)
def mixed(low: float, high: float, m: float, film: Film) -> float:
    """Conductivity of a column with a metallic fraction m: McLachlan's general effective medium, or in parallel."""
    if film.critical <= 0.0 or m <= 0.0 or m >= 1.0:
        return low * (1.0 - m) + high * m
    a = (1.0 - film.critical) / film.critical
    s, t = 1.0 / film.low_exponent, 1.0 / film.high_exponent
    low_s, high_t = low**s, high**t
    left, right = log(low), log(high)
    for _ in range(SEARCH):
        middle = 0.5 * (left + right)
        of_low, of_high = exp(s * middle), exp(t * middle)
        value = (1.0 - m) * (low_s - of_low) / (low_s + a * of_low)
        value += m * (high_t - of_high) / (high_t + a * of_high)
        if value > 0.0:
            left = middle
        else:
            right = middle
        if right - left < 1e-11:
            break
    return exp(0.5 * (left + right))


@njit(cache=True)
def resistance(temperature: float, room: float, columns: Array, profile: Array, film: Film) -> float:
    """Resistance [ohm] at a mean `temperature` [°C]; `columns`: their metallic fractions, `profile`: their warmth."""
    total, high = 0.0, 1.0 / film.metal
    for j in range(columns.size):
        kelvin = room + profile[j] * (temperature - room) + 273.15
        low = exp(-film.activation * (1.0 / kelvin - 1.0 / 298.15)) / film.semiconductor
        total += 1.0 / mixed(low, high, min(max(columns[j], 0.0), 1.0), film)
    return total / columns.size


@njit(cache=True)
def resistances(temperature: Array, room: Array, columns: Array, profile: Array, film: Film) -> Array:
    """Resistance [ohm] of each row."""
    out = np.empty(temperature.size)
    for k in range(temperature.size):
        out[k] = resistance(temperature[k], room[k], columns[k], profile, film)
    return out


@njit(cache=True)
def turn(i: int, sign: float, grains: Grains, metal: Array, sums: Array) -> None:
    """Grain i turns metallic (1) or back (-1); `sums`: fractions electrical, structural, of each column."""
    metal[i] = sign > 0.0
    sums[0] += sign * grains.electrical[i]
    sums[1] += sign * grains.bends[i]
    sums[2 + grains.column[i]] += sign * grains.in_column[i]


@njit(cache=True)
def calm(room: float, heat: Heat, grains: Grains, metal: Array, sums: Array, range_C: Array) -> None:
    """Set `range_C` to the film's temperatures [°C] at which no grain turns, and to the room's for which it holds."""
    range_C[0], range_C[1], range_C[2] = -np.inf, np.inf, room
    helped = room + heat.coupling * sums[0]
    for i in range(grains.up.size):
        if metal[i]:
            range_C[0] = max(range_C[0], room + (grains.down[i] - helped) / grains.profile[i])
        else:
            range_C[1] = min(range_C[1], room + (grains.up[i] - helped) / grains.profile[i])


@njit(cache=True)
def settle(
    film: float, room: float, heat: Heat, grains: Grains, metal: Array, sums: Array, range_C: Array
) -> float:
    """Switch grains until none has a reason left; returns the film's temperature [°C] less their latent heat."""
    if room == range_C[2] and range_C[0] <= film < range_C[1]:
        return film
    for _ in range(PASSES):
        changed = False
        for i in range(grains.up.size):
            seen = room + grains.profile[i] * (film - room) + heat.coupling * sums[0]
            if not metal[i] and seen >= grains.up[i]:
                turn(i, 1.0, grains, metal, sums)
                film -= heat.latent * grains.electrical[i]
                changed = True
        for i in grains.falling:
            seen = room + grains.profile[i] * (film - room) + heat.coupling * sums[0]
            if metal[i] and seen < grains.down[i]:
                turn(i, -1.0, grains, metal, sums)
                film += heat.latent * grains.electrical[i]
                changed = True
        if not changed:
            break
    calm(room, heat, grains, metal, sums, range_C)
    return film


@njit(cache=True)
def heat_up(
    power: Array, room: Array, heat: Heat, grains: Grains, profile: Array, film: Film
) -> tuple[Array, Array]:
    """Temperature [°C] and fractions (electrical, structural, of each column) at the edges of all steps.

    `power`: final rise [K] that the current of each step would bring; `room` [°C] at the edges.
    """
    n, columns = power.size, profile.size
    out, parts = np.empty(n + 1), np.zeros((n + 1, 2 + columns))
    metal, sums = np.zeros(grains.up.size, dtype=np.bool_), np.zeros(2 + columns)
    range_C = np.full(3, np.nan)
    keep, keep_layer = exp(-heat.step / heat.tau), exp(-heat.step / heat.layer)
    keep_slow = exp(-heat.step / heat.slow)
    keep_seen = exp(-heat.step / heat.lag) if heat.lag > 0.0 else 0.0
    ahead = heat.layer / (heat.layer - heat.tau)  # of the layer's free part in the film
    cold = resistance(heat.ambient, heat.ambient, sums[2:], profile, film)
    fast, slow, layer = room[0] + heat.sense, 0.0, 0.0
    seen = settle(fast, room[0], heat, grains, metal, sums, range_C)
    out[0], parts[0] = fast, sums
    for k in range(n):
        given = power[k] * (1.0 + heat.tcr * (fast + slow - heat.ambient))
        final = room[k]
        if heat.sense > 0.0:
            final += heat.sense * resistance(fast + slow, room[k], sums[2:], profile, film) / cold
        direct = (1.0 - heat.slow_share) * given
        free = layer - direct
        rest = fast - final - direct - ahead * free
        fast = final + direct + ahead * free * keep_layer + rest * keep
        layer = direct + free * keep_layer
        slow = heat.slow_share * given + (slow - heat.slow_share * given) * keep_slow
        seen = fast + slow + (seen - fast - slow) * keep_seen
        left = settle(seen, room[k + 1], heat, grains, metal, sums, range_C)
        if heat.latent > 0.0:
            fast += left - seen
            seen = left
        out[k + 1], parts[k + 1] = fast + slow, sums
    return out, parts
