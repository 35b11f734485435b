"""Compiled steps of a sputtered film on a cantilever: heat, cells that turn bit by bit, resistance of the mixture.

Cell i is metallic by a part m_i: a front begins to cross it at `up` on heating and is through 1/speed later; it goes
back to `down` on cooling. So m_i = min(max(m_i, speed (T - up)), speed (T - down)), cut to 0..1: a play between ramps.
The structure follows with thresholds `later` K higher. Most of the heat comes with tau, a little of it faster.
"""

from __future__ import annotations

from math import exp, log
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from numba import njit

SEARCH = 20  # halvings of the search for the temperature that the latent heat leaves


class Heat(NamedTuple):
    """Thermal path and what may be hidden in it; times in s, temperatures in K, 0 is absent."""

    tau: float
    second: float  # time constant of the fin's next mode
    second_share: float  # of the heat, with that time constant
    step: float
    ambient: float  # °C
    slow_share: float = 0.0
    slow: float = 1.0
    tcr: float = 0.0  # 1/K
    sense: float = 0.0  # by the sense current, cold
    lag: float = 0.0  # of the fractions behind their equilibrium
    latent: float = 0.0


class Film(NamedTuple):
    """What the resistance is made of: sigma^p = (1 - m) semiconductor^p + m metal^p (Lichtenecker and Rother)."""

    semiconductor: float  # ohm at 25 °C
    activation: float  # K
    metal: float  # ohm at 70 °C
    metal_per_K: float
    contacts: float  # ohm, in series
    power: float


class Cells(NamedTuple):
    """Thresholds [°C] of the cells and their shares, which sum to 1."""

    up: Array
    down: Array
    speed: Array  # 1/K, of the front that crosses a cell
    electrical: Array
    structural: Array
    later: float  # K


@njit(cache=True)
def resistance(temperature: float, m: float, film: Film) -> float:
    """Resistance [ohm] at `temperature` [°C] with a metallic fraction m."""
    kelvin = temperature + 273.15
    low = exp(-film.activation * (1.0 / kelvin - 1.0 / 298.15)) / film.semiconductor
    high = 1.0 / (film.metal * (1.0 + film.metal_per_K * (temperature - 70.0)))
    m = min(max(m, 0.0), 1.0)
    inside = (1.0 - m) * exp(film.power * log(low)) + m * exp(film.power * log(high))
    return film.contacts + exp(-log(inside) / film.power)


@njit(cache=True)
def resistances(temperature: Array, m: Array, film: Film) -> Array:
    """Resistance [ohm] of each row."""
    out = np.empty(temperature.size)
    for k in range(temperature.size):
        out[k] = resistance(temperature[k], m[k], film)
    return out


@njit(cache=True, fastmath=True)  # no NaN in it, and the order of the sum does not matter
def play(over: float, cells: Cells, shares: Array, metallic: Array, keep: bool) -> float:
    """Mean of the cells' fractions if the film went to `over` [°C]; `keep`: it goes, and `metallic` with it."""
    total = 0.0
    for i in range(cells.up.size):
        m = max(metallic[i], min((over - cells.up[i]) * cells.speed[i], 1.0))
        m = min(m, max((over - cells.down[i]) * cells.speed[i], 0.0))
        total += shares[i] * m
        if keep:
            metallic[i] = m
    return total


@njit(cache=True)
def left_by_latent(temperature: float, before: float, latent: float, cells: Cells, metallic: Array) -> float:
    """Temperature [°C] that the film keeps of `temperature` once its fraction has moved on from `before`."""
    turned = play(temperature, cells, cells.electrical, metallic, False) - before
    low, high = temperature - latent * max(turned, 0.0), temperature - latent * min(turned, 0.0)
    for _ in range(SEARCH if turned != 0.0 else 0):
        middle = 0.5 * (low + high)
        if middle + latent * (play(middle, cells, cells.electrical, metallic, False) - before) > temperature:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@njit(cache=True)
def warm(power: Array, room: Array, heat: Heat, cells: Cells, film: Film) -> tuple[Array, Array, Array]:
    """Temperature [°C] and the electrical and structural fractions at the edges of all steps.

    `power`: final rise [K] that the current of each step would bring; `room` [°C] at the edges.
    """
    n = power.size
    out, electrical, structural = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    carriers, lattice = np.zeros(cells.up.size), np.zeros(cells.up.size)
    keep, keep_second = exp(-heat.step / heat.tau), exp(-heat.step / heat.second)
    keep_slow, keep_lag = exp(-heat.step / heat.slow), exp(-heat.step / heat.lag) if heat.lag > 0.0 else 0.0
    cold = resistance(heat.ambient, 0.0, film)
    main, second, slow = room[0] + heat.sense, 0.0, 0.0
    at_once, m, bent = 0.0, 0.0, 0.0
    out[0], electrical[0], structural[0] = main, m, bent
    for k in range(n):
        given = power[k] * (1.0 + heat.tcr * (out[k] - heat.ambient))
        read = heat.sense * resistance(out[k], m, film) / cold if heat.sense > 0.0 else 0.0
        quick = heat.second_share * given
        late = heat.slow_share * given
        final = room[k] + read + given - quick - late
        main = final + (main - final) * keep
        second = quick + (second - quick) * keep_second
        slow = late + (slow - late) * keep_slow
        free = main + second + slow
        if heat.latent > 0.0:
            left = left_by_latent(free, at_once, heat.latent, cells, carriers)
            main += left - free
            free = left
        at_once = play(free, cells, cells.electrical, carriers, True)
        settled = play(free - cells.later, cells, cells.structural, lattice, True)
        m = at_once + (m - at_once) * keep_lag
        bent = settled + (bent - settled) * keep_lag
        out[k + 1], electrical[k + 1], structural[k + 1] = free, m, bent
    return out, electrical, structural
