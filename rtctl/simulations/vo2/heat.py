"""The heat balance where more acts than one time constant; see `balance_pieces`."""

from __future__ import annotations

import math

import numpy as np

from rtctl.hysteresis.everett import everett_falling_slope, everett_rising_slope
from rtctl.hysteresis.preisach import MAX_EXTREMA, PreisachParams, cooled_stack, preisach_step
from rtctl.kernels import FloatArray, background_kernel, kernel
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.mechanism import Balance, Pieces
from rtctl.simulations.vo2.relaxation import at, relax

LEAST_POWER = 1e-6  # mA^2, under the root
LEAST_CAPACITY = 0.1  # of the film's own, left by a self-heating that runs away
BISECTIONS = 60


@kernel
def surrogate_power(T: float, b: Balance) -> float:
    """s [mA^2] that the identified loops know by a temperature T [mA^2]."""
    return T * (1.0 + b.loss_known * T) / (1.0 + b.tcr_known * T)


@kernel
def surrogate_slope(T: float, b: Balance) -> float:
    """ds / dT."""
    below = 1.0 + b.tcr_known * T
    return (1.0 + 2.0 * b.loss_known * T + b.tcr_known * b.loss_known * T * T) / (below * below)


@kernel
def steady_temperature(power: float, b: Balance) -> float:
    """T with T (1 + loss T) = power (1 + tcr T)."""
    half = 1.0 - b.tcr * power
    return 2.0 * power / (half + math.sqrt(half * half + 4.0 * b.loss * power))


@kernel
def relay_slope(state: FloatArray, rising: bool, p: PreisachParams) -> float:
    """Of the relays' mass over v, if v now rises or falls."""
    top = int(state[0])
    v = float(state[1 + top])
    if rising:
        before = float(state[top]) if top % 2 == 1 else v
        return everett_rising_slope(v, before, p.grid, p.nodes)
    before = float(state[top]) if top % 2 == 0 and top > 0 else v
    return everett_falling_slope(before, v, p.grid, p.nodes)


@kernel
def resistance_share(state: FloatArray, cold: float, p: PreisachParams) -> float:
    """R over the cold film's."""
    top = int(state[0])
    v = float(state[1 + top])
    return math.exp(cold - p.c - p.sign * float(state[1 + MAX_EXTREMA + top]) - v * (p.c1 + p.c2 * v))


@kernel
def stored(
    beam: FloatArray, film: FloatArray, cold: float, b: Balance, d: PreisachParams, r: PreisachParams
) -> float:
    """Heat [mA^2] that the phase holds beyond T, and what self-heating the loops know already."""
    heat = 0.0
    if b.latent != 0.0:
        heat = b.latent * float(beam[1 + MAX_EXTREMA + int(beam[0])]) / d.nodes[-1, 0]
    if b.self_heating != 0.0:
        heat += b.self_heating_known * resistance_share(film, cold, r)
    return heat


@kernel
def stored_slope(
    beam: FloatArray,
    film: FloatArray,
    rising: bool,
    cold: float,
    b: Balance,
    d: PreisachParams,
    r: PreisachParams,
) -> float:
    """d stored / dv, if v now rises or falls."""
    slope = 0.0
    if b.latent != 0.0:
        slope = b.latent * relay_slope(beam, rising, d) / d.nodes[-1, 0]
    if b.self_heating != 0.0:
        v = float(film[1 + int(film[0])])
        own = r.sign * relay_slope(film, rising, r) + r.c1 + 2.0 * r.c2 * v
        slope -= b.self_heating_known * resistance_share(film, cold, r) * own
    return slope


@kernel
def extra_heat(T: float, power: float, film: FloatArray, cold: float, b: Balance, r: PreisachParams) -> float:
    """What heats and cools beyond power - T [mA^2]."""
    extra = (b.tcr * power - b.loss * T) * T
    if b.self_heating != b.self_heating_known:
        extra += (b.self_heating - b.self_heating_known) * resistance_share(film, cold, r)
    return extra


@kernel
def settle_film(T: float, b: Balance, params: PreisachParams) -> FloatArray:
    """The state at T after a full cooling."""
    state = cooled_stack(params.grid)
    preisach_step(state, math.sqrt(max(surrogate_power(T, b), 0.0)), params)
    return state


@kernel
def first_temperature(power: float, cold: float, b: Balance, r: PreisachParams) -> float:
    """T at which a constant power holds the film, heated from cold."""
    T = steady_temperature(power, b)
    if b.self_heating == b.self_heating_known:
        return T
    low, high = T, T + 4.0 * (b.self_heating - b.self_heating_known)
    for _ in range(BISECTIONS):
        T = 0.5 * (low + high)
        if power + extra_heat(T, power, settle_film(T, b, r), cold, b, r) > T:
            low = T
        else:
            high = T
    return T


@background_kernel
def balance_pieces(
    nodes: FloatArray, durations: FloatArray, substeps: int, cold: float, b: Balance,
    d: PreisachParams, r: PreisachParams,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Surrogate and what the relays see of it [mA^2] at the ends of all substeps (pieces * substeps + 1,).

    P = i^2, T = (1 - share) T_1 + share T_2, Q the heat that the phase has stored:
    tau (T_1 + Q)' = P (1 + tcr T) - loss T^2 + self_heating R / R_cold - T_1, and so T_2 with its own time constant
    without Q. `cold` is -ln of the cold film's resistance, `d` and `r` are the read-outs of deflection and -ln R.
    A step takes the capacity 1 + dQ/dT_1 of its first moment; the next one gets the heat by which Q came out otherwise.
    """
    T = first_temperature(nodes[0, 0] * nodes[0, 0], cold, b, r)
    beam, film = settle_film(T, b, d), settle_film(T, b, r)
    phase = b.latent != 0.0 or b.self_heating != 0.0
    main, second, carry, Q = T, T, 0.0, stored(beam, film, cold, b, d, r)
    s = surrogate_power(T, b)
    lagged = s
    power, lagging = np.empty(nodes.shape[0] * substeps + 1), np.empty(nodes.shape[0] * substeps + 1)
    power[0] = lagging[0] = s
    for step in range(nodes.shape[0] * substeps):
        row, j = step // substeps, step % substeps
        h = durations[row % durations.size] / substeps
        p0 = at(nodes, row, j / substeps) ** 2
        pq = at(nodes, row, (j + 0.25) / substeps) ** 2
        pm = at(nodes, row, (j + 0.5) / substeps) ** 2
        p1 = at(nodes, row, (j + 1.0) / substeps) ** 2
        e = extra_heat(T, p0, film, cold, b, r)
        half = (1.0 - b.share) * relax(main, p0 + e, pq + e, pm + e, 0.5 * h, b.time_constant_s)
        half += b.share * relax(second, p0 + e, pq + e, pm + e, 0.5 * h, b.second_time_constant_s)
        e = extra_heat(half, pm, film, cold, b, r)
        moved = relax(main, p0 + e, pm + e, p1 + e, h, b.time_constant_s)
        second = relax(second, p0 + e, pm + e, p1 + e, h, b.second_time_constant_s)
        capacity = 1.0
        if phase:
            dv = (1.0 - b.share) * surrogate_slope(T, b) / (2.0 * math.sqrt(max(s, LEAST_POWER)))
            slope = stored_slope(beam, film, moved + carry > main, cold, b, d, r) * dv
            capacity = max(1.0 + slope, LEAST_CAPACITY)
            wanted = relax(main, p0 + e, pm + e, p1 + e, h, b.time_constant_s * capacity) - main
            moved = main + wanted + carry / capacity
            carry += capacity * wanted - (moved - main)
        main = moved
        T = (1.0 - b.share) * main + b.share * second
        before, s = s, surrogate_power(T, b)
        if phase:
            v = math.sqrt(max(s, 0.0))
            preisach_step(beam, v, d)
            preisach_step(film, v, r)
            held, Q = Q, stored(beam, film, cold, b, d, r)
            carry -= Q - held
        lagged = relax(lagged, before, 0.5 * (before + s), s, h, b.lag_s)
        power[step + 1], lagging[step + 1] = s, lagged
    return power, lagging


def heat_balance(
    pieces: Pieces, substeps: int, balance: Balance, model: Vo2Model
) -> tuple[FloatArray, FloatArray]:
    """`balance_pieces` with the model's read-outs; the second path is the first where relays do not lag."""
    power, lagging = balance_pieces(
        pieces.nodes, pieces.durations_s, substeps, -math.log(model.resistance.high),
        balance, model.deflection_preisach.params, model.resistance_preisach.params,
    )  # fmt: skip
    return power, lagging if balance.lag_s != 0.0 else power
