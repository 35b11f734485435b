"""The heat balance with more effects than one time constant; see `balance_pieces`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp, expm1
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel, uncounted
from rtctl.border.mechanisms import STEADY
from rtctl.hysteresis.preisach.everett import everett
from rtctl.hysteresis.preisach.model import MAX_EXTREMA, PreisachParams, preisach_step, uncounted_params
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.mechanism import Balance, Pieces
from rtctl.simulations.vo2.phases import Phases
from rtctl.simulations.vo2.relaxation import at, relax, turn

LEAST_CHANGE = 1e-9  # mA^2, below which a step says nothing of a capacity
LEAST_CAPACITY = 0.1  # of the film's own, left by a self-heating that runs away
ITERATIONS = 3
SAME_CAPACITY = 1e-9  # of it: closer, another iteration changes nothing
BISECTIONS = 60


class Powers(NamedTuple):
    """Power of the heater at start, quarter, middle and end of a substep [mA^2]."""

    start: float
    quarter: float
    middle: float
    end: float


class Step(NamedTuple):
    """Result of a substep.

    T_1, T_2, T at its end and T in its middle [mA^2], its capacity, the heat stored [mA^2] and the share of the film
    that
    has changed phase.
    """

    main: float
    second: float
    T: float
    half: float
    capacity: float
    stored: float
    phase: float


@kernel
def drifted_s(time_s: float, settling_s: float) -> float:
    """Return `rtctl.border.mechanisms.drift_of` at one time."""
    return time_s if settling_s == STEADY else -settling_s * expm1(-time_s / settling_s)


@kernel
def surrogate_power(T: float, b: Balance) -> float:
    """Return the s [mA^2] at which the identified loops have a temperature T [mA^2]."""
    return T * (1.0 + b.loss_known * T) / (1.0 + b.tcr_known * T)


@kernel
def loop_current(s: float, b: Balance) -> float:
    """Return the v [mA] at which the identified loops are at s [mA^2]."""
    return math.sqrt(max(s, 0.0)) + b.zone


@kernel
def heating_power(current: float, b: Balance) -> float:
    """Return the power [mA^2] of a current [mA] of either sign, less its part that does not heat."""
    heating = max(abs(current) - b.zone, 0.0)
    return heating * heating


@kernel
def balanced(power: float, tcr: float, loss: float) -> float:
    """Return the T with T (1 + loss T) = power (1 + tcr T)."""
    half = 1.0 - tcr * power
    return 2.0 * power / (half + math.sqrt(half * half + 4.0 * loss * power))


@kernel
def steady_temperature(power: float, b: Balance) -> float:
    """T that a constant power [mA^2] holds, but for self-heating."""
    return balanced(power, b.tcr, b.loss)


@kernel
def temperature_at(power: float, b: Balance) -> float:
    """T [mA^2] where the identified loops are at the square of a current [mA^2]; below 0 in a room that cools."""
    beyond = math.sqrt(max(power, 0.0)) - b.zone
    s = beyond * beyond if beyond > 0.0 else power - b.zone * b.zone
    return balanced(s, b.tcr_known, b.loss_known)


@background_kernel
def temperatures(power: FloatArray, b: Balance) -> FloatArray:
    """`temperature_at` of each instant (n,)."""
    found = np.empty(power.size)
    for k in range(power.size):
        found[k] = temperature_at(power[k], b)
    return found


@kernel
def relays_at(state: FloatArray, v: float, p: PreisachParams) -> float:
    """Return the output of the relays at v without changing their memory; see `move_input`."""
    v = min(max(v, p.grid[0]), p.grid[-1])
    top, levels = int(state[0]), 1 + state.size // 2
    if v == state[1 + top]:
        return float(state[levels + top])
    rising = v > state[1 + top]
    if rising != (top % 2 == 1):
        top += 1
    if rising:
        while top >= 3 and v >= state[top - 1]:
            top -= 2
        return float(state[levels + top - 1]) + everett(v, state[top], p.grid, p.nodes)
    while top >= 2 and v <= state[top - 1]:
        top -= 2
    if top == 0:
        return 0.0
    return float(state[levels + top - 1]) - everett(state[top], v, p.grid, p.nodes)


@kernel
def resistance_share(film: FloatArray, v: float, cold: float, p: PreisachParams) -> float:
    """R at v over the cold film's."""
    v = min(max(v, p.grid[0]), p.grid[-1])
    return exp(cold - p.c - p.sign * relays_at(film, v, p) - v * (p.c1 + p.c2 * v))


@kernel
def metallic_share(film: FloatArray, v: float, p: PreisachParams) -> float:
    """Share of the film, by the resistance's relays at v."""
    return float(relays_at(film, v, p) / p.nodes[-1, 0])


@kernel
def growth_known(T: float, film: FloatArray, b: Balance, r: PreisachParams) -> float:
    """Return by what factor the heating has grown with the phase, as far as the loops know it already."""
    if b.phase_heating_known == 0.0:
        return 1.0
    v = loop_current(surrogate_power(T, b), b)
    return 1.0 + b.phase_heating_known * metallic_share(film, v, r)


@kernel
def stored(T: float, phase: float, film: FloatArray, cold: float, b: Balance, r: PreisachParams) -> float:
    """Heat [mA^2] that the phase holds beyond T, and what of heat by the phase the loops know already."""
    heat = b.latent * phase
    if b.film_heat != 0.0:
        heat += b.film_heat * metallic_share(film, loop_current(surrogate_power(T, b), b), r)
    if b.phase_heating_known != 0.0:
        heat += T * (growth_known(T, film, b, r) - 1.0)
    if b.self_heating_known != 0.0:
        v = loop_current(surrogate_power(T, b), b)
        heat += b.self_heating_known * resistance_share(film, v, cold, r)
    return heat


@kernel
def phase_at(T: float, beam: FloatArray, b: Balance, d: PreisachParams) -> float:
    """Share of the film, by the deflection's relays; 0 where no heat depends on it."""
    if b.latent == 0.0 and b.sharpness == 0.0:
        return 0.0
    return float(relays_at(beam, loop_current(surrogate_power(T, b), b), d) / d.nodes[-1, 0])


@kernel
def bends(b: Balance) -> bool:
    """Whether the middle of a step matters to its end: heat that depends on temperature, or relays that lag."""
    of_phase = b.self_heating != b.self_heating_known or b.phase_heating != b.phase_heating_known
    return of_phase or b.tcr != 0.0 or b.loss != 0.0 or b.lag_s != 0.0


@kernel
def stores(b: Balance) -> bool:
    """Whether heat is stored beyond what a constant capacity does."""
    known = b.self_heating_known != 0.0 or b.phase_heating_known != 0.0
    return known or b.latent != 0.0 or b.sharpness != 0.0 or b.film_heat != 0.0


@kernel
def extra_heat(
    T: float, power: float, drift: float, film: FloatArray, cold: float, b: Balance, r: PreisachParams
) -> float:
    """Return the heating and cooling beyond power - T [mA^2], of a film at T + drift."""
    extra = (b.tcr * power - b.loss * T) * T
    if b.self_heating != b.self_heating_known:
        v = loop_current(surrogate_power(T + drift, b), b)
        extra += (b.self_heating - b.self_heating_known) * resistance_share(film, v, cold, r)
    if b.phase_heating != b.phase_heating_known:
        v = loop_current(surrogate_power(T + drift, b), b)
        extra += (b.phase_heating - b.phase_heating_known) * metallic_share(film, v, r) * power
    return extra


@kernel
def cool(state: FloatArray, params: PreisachParams) -> None:
    """Reset `state` to that after a full cooling."""
    state[:] = 0.0  # `cooled_stack`, which is no kernel
    state[1] = params.grid[0]


@kernel
def settle_film(state: FloatArray, T: float, b: Balance, params: PreisachParams) -> None:
    """Set `state` to that at T after a full cooling."""
    cool(state, params)
    preisach_step(state, loop_current(surrogate_power(T, b), b), params)


@kernel
def first_temperature(power: float, film: FloatArray, cold: float, b: Balance, r: PreisachParams) -> float:
    """Return the T at which a constant power holds the film, heated from cold; leaves `film` cooled."""
    T = steady_temperature(power, b)
    growth = (b.phase_heating - b.phase_heating_known) * power
    if b.self_heating == b.self_heating_known and growth == 0.0:
        return T
    low = T + min(growth, 0.0)
    high = T + 4.0 * (b.self_heating - b.self_heating_known) + max(growth, 0.0)
    for _ in range(BISECTIONS):
        T = 0.5 * (low + high)
        settle_film(film, T, b, r)
        if power + extra_heat(T, power, 0.0, film, cold, b, r) > T:
            low = T
        else:
            high = T
    cool(film, r)
    return T


# many parameters because a compiled kernel takes plain arrays and NamedTuples, not an object
@kernel
def advance(  # noqa: PLR0913
    step: Step, power: Powers, drift: float, h: float, beam: FloatArray, film: FloatArray, cold: float, b: Balance,
    d: PreisachParams, r: PreisachParams,
) -> Step:  # fmt: skip
    """Advance by one substep of h [s] in a room warmer by `drift` [mA^2], as is the film then; moves no relays."""
    p0, pq, pm, p1 = power
    e = extra_heat(step.T, p0, drift, film, cold, b, r)
    base = b.time_constant_s * (1.0 + b.cooling if pm + e < step.T else 1.0)
    kept, tau, slow = 1.0 - b.share, base * step.capacity, b.second_time_constant_s
    half = step.T
    if bends(b):
        half = kept * relax(step.main, p0 + e, pq + e, pm + e, 0.5 * h, tau)
        if b.share != 0.0:
            half += b.share * relax(step.second, p0 + e, pq + e, pm + e, 0.5 * h, slow)
        e = extra_heat(half, pm, drift, film, cold, b, r)
    main, second = relax(step.main, p0 + e, pm + e, p1 + e, h, tau), step.second
    if b.share != 0.0:
        second = relax(step.second, p0 + e, pm + e, p1 + e, h, slow)
    T = kept * main + b.share * second
    if not stores(b):
        return Step(main, second, T, half, step.capacity, step.stored, step.phase)
    capacity = step.capacity
    grown = growth_known(step.T + drift, film, b, r)
    phase = phase_at(T + drift, beam, b, d)
    heat = stored(T + drift, phase, film, cold, b, r)
    for _ in range(ITERATIONS):
        before, change = capacity, main - step.main
        if abs(change) > LEAST_CHANGE:
            rate = (phase - step.phase) / change
            capacity = max(1.0 + (heat - step.stored) / change + b.sharpness * rate * rate, LEAST_CAPACITY)
            capacity /= 0.5 * (grown + growth_known(T + drift, film, b, r))
        if abs(capacity - before) <= SAME_CAPACITY * before:
            break
        main = relax(step.main, p0 + e, pm + e, p1 + e, h, base * capacity)
        T = kept * main + b.share * second
        phase = phase_at(T + drift, beam, b, d)
        heat = stored(T + drift, phase, film, cold, b, r)
    return Step(main, second, T, half, capacity, heat, phase)


# many parameters because a compiled kernel takes plain arrays and NamedTuples, not an object
@background_kernel
def balance_pieces(  # noqa: PLR0913
    nodes: FloatArray, durations: FloatArray, substeps: int, memory: FloatArray, cold: float, b: Balance,
    d: PreisachParams, r: PreisachParams, start: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Return the surrogate, its value for the relays, and that value's turning points [mA^2] at all substeps' ends.

    All of shape (pieces * substeps + 1,), from rest at `start` [mA^2], or in the first current where that is NaN.
    P = i^2, T = (1 - share) T_1 + share T_2, Q
    the heat that the phase has stored:
    tau (T_1 + Q)' = P (1 + tcr T + phase_heating phi) - loss T^2 + self_heating R / R_cold - T_1, and so T_2 with its
    own time constant without Q. `memory` (2, 1 + 2 MAX_EXTREMA) is for the relays' states,
    `cold` is -ln of the cold film's resistance, `d` and `r` are the read-outs of deflection and -ln R.
    A step's capacity 1 + dQ / dT_1 is that between its ends, by iteration.
    """
    d, r, beam, film = uncounted_params(d), uncounted_params(r), uncounted(memory[0]), uncounted(memory[1])
    if math.isnan(start):
        T = first_temperature(nodes[0, 0] * nodes[0, 0], film, cold, b, r)
    else:
        T = temperature_at(start, b)
    settle_film(beam, T, b, d)
    settle_film(film, T, b, r)
    phase = phase_at(T, beam, b, d)
    step = Step(T, T, T, T, 1.0, stored(T, phase, film, cold, b, r), phase)
    warm = lagged = T
    size = nodes.shape[0] * substeps + 1
    power = np.empty(size)
    lagging, peaks = (np.empty(size), np.empty(size)) if b.lag_s != 0.0 else (power, power)
    power[0] = lagging[0] = peaks[0] = surrogate_power(T, b)
    time_s = drift = 0.0
    for k in range(1, size):
        row, x, dx = (k - 1) // substeps, ((k - 1) % substeps) / substeps, 1.0 / substeps
        h = durations[row % durations.size] / substeps
        heater = Powers(
            at(nodes, row, x) ** 2, at(nodes, row, x + 0.25 * dx) ** 2,
            at(nodes, row, x + 0.5 * dx) ** 2, at(nodes, row, x + dx) ** 2,
        )  # fmt: skip
        halfway = b.drift * drifted_s(time_s + 0.5 * h, b.settling_s)
        time_s += h
        drift = b.drift * drifted_s(time_s, b.settling_s)
        step = advance(step, heater, drift, h, beam, film, cold, b, d, r)
        before, warm = warm, step.T + drift
        s = surrogate_power(warm, b)
        if b.latent != 0.0 or b.sharpness != 0.0:
            preisach_step(beam, loop_current(s, b), d)
        if b.self_heating != 0.0 or b.film_heat != 0.0 or b.phase_heating != 0.0:
            preisach_step(film, loop_current(s, b), r)
        power[k] = s
        if b.lag_s == 0.0:
            continue
        middle = step.half + halfway
        peak = turn(lagged, before, middle, warm, h, b.lag_s)
        lagged = relax(lagged, before, middle, warm, h, b.lag_s)
        lagging[k] = peaks[k] = surrogate_power(lagged, b)
        if not math.isnan(peak):
            peaks[k] = surrogate_power(peak, b)
    return power, lagging, peaks


def heat_balance(
    pieces: Pieces, substeps: int, balance: Balance, model: Vo2Model, start: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Run `balance_pieces` with the model's read-outs; where relays do not lag, all paths are the first."""
    power, lagging, peaks = balance_pieces(
        pieces.nodes, pieces.durations_s, substeps, np.empty((2, 1 + 2 * MAX_EXTREMA)),
        -math.log(model.resistance.high), balance, model.deflection_preisach.params, model.resistance_preisach.params,
        start,
    )  # fmt: skip
    return (power, lagging, peaks) if balance.lag_s != 0.0 else (power, power, power)


def phases_of(model: Vo2Model, balance: Balance) -> Phases:
    """Return the phases of the film as it was identified."""
    return Phases(
        -math.log(model.resistance.high),
        -math.log(model.resistance.low),
        temperature_at(model.current.low**2, balance),
        temperature_at(model.current.high**2, balance),
    )
