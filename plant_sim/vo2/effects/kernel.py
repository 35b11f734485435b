"""Holding a current on a device with effects (see `effects`): the hold in parts, over which its terms are frozen.

Every linear part is solved exactly over a part of a hold, with the nonlinear terms taken in its middle; the relays
settle at its end. The delay line is a ring of levels and when each was commanded.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from plant_sim.kernels import Record, compiled
from plant_sim.sensing import REFERENCE, WHITE, drift, read_deflection, read_resistance
from plant_sim.vo2.deflection import deflection_at
from plant_sim.vo2.domains import ELECTRICAL, STRUCTURAL, Floats
from plant_sim.vo2.limiting_loop import follow
from plant_sim.vo2.relays import settle
from plant_sim.vo2.resistance import resistance_at

Array = NDArray[np.void]
QUEUE = 16384
"""Most levels on their way at once."""
SAME_S = 1e-12

OWN = np.dtype(
    [
        ("step", np.float64),  # longest part of a hold [s]
        ("cold", np.float64),  # resistance at power-up [ohm]
        ("time", np.float64),  # since power-up [s]
        ("warming_from", np.float64),  # time at which a drift has begun [s]
        ("gain_drift_from", np.float64),
        ("ageing_from", np.float64),
        ("first", np.float64),  # th_1, th_2 [K]
        ("second", np.float64),
        ("seen", np.float64),  # T_d [degC]
        ("acting", np.float64),  # y [mA]
        ("bent", np.float64),  # D at the end of the last part [um]
        ("swing", np.float64),  # q [um]
        ("speed", np.float64),  # q' [um/s]
        ("film", np.float64),  # R (1 + ageing t) + leak y at the end of the last part [ohm]
        ("reading", np.float64),  # Y [ohm]
        ("tail", np.int64),  # of the queue: the level in force
        ("head", np.int64),  # the last one commanded
    ]
)


@compiled
def command(own: Record, queue: Floats, current_mA: float) -> None:
    """Command a level now; rows of `queue` (2, QUEUE) are times [s] and levels [mA]."""
    if current_mA == queue[1, own.head]:
        return
    following = (own.head + 1) % QUEUE
    if following != own.tail:  # full: the last one is replaced
        own.head = following
    queue[0, own.head] = own.time
    queue[1, own.head] = current_mA


@compiled
def part_of_hold(p: Record, own: Record, queue: Floats, left_s: float) -> float:
    """Return the next part of a hold [s]; put levels that have arrived in force."""
    delay = p.effects.delay
    while own.tail != own.head and queue[0, (own.tail + 1) % QUEUE] + delay <= own.time + SAME_S:
        own.tail = (own.tail + 1) % QUEUE
    away = queue[1, own.tail] - own.acting
    if abs(away) > p.effects.backlash:
        own.acting += away - math.copysign(p.effects.backlash, away)
    h: float = min(left_s, own.step)
    if own.tail != own.head:
        h = min(h, max(queue[0, (own.tail + 1) % QUEUE] + delay - own.time, SAME_S))
    return h


@compiled
def heating_power(p: Record, s: Record, own: Record, rise: float) -> float:
    """Return the heating power P [K] with the film `rise` [K] above power-up's ambient."""
    e = p.effects
    current = own.acting * (1.0 + e.gain_drift * (own.time - own.gain_drift_from))
    grown = 1.0 + e.tcr * rise + e.phase_heating * s.electrical
    power = p.heating.gain * current * current * grown - e.loss * rise * rise
    if e.sensing != 0.0:
        power += e.sensing * resistance_at(p.resistance, s.temperature, s.electrical) / own.cold
    return float(power)


@compiled
def warm(p: Record, s: Record, own: Record, h: float) -> None:
    """Return the temperatures after a part of a hold."""
    e, share = p.effects, p.effects.second_share
    rise = (1.0 - share) * own.first + share * own.second
    power = heating_power(p, s, own, rise)
    half = math.exp(-0.5 * h / p.heating.time_constant)
    half_second = math.exp(-0.5 * h / e.second_time_constant)
    middle = (1.0 - share) * (power + (own.first - power) * half)
    middle += share * (power + (own.second - power) * half_second)
    power = heating_power(p, s, own, middle)
    own.first = power + (own.first - power) * half * half
    own.second = power + (own.second - power) * half_second * half_second
    own.time += h
    before = s.temperature
    s.temperature = p.heating.ambient + e.warming * (own.time - own.warming_from)
    s.temperature += (1.0 - share) * own.first + share * own.second
    if e.domain_lag == 0.0:
        own.seen = s.temperature
    else:
        own.seen = trailing(own.seen, before, s.temperature, h / e.domain_lag)


@compiled
def trailing(y: float, before: float, after: float, ratio: float) -> float:
    """Return a first-order lag behind what moves linearly from `before` to `after` in `ratio` time constants."""
    if ratio < 1e-9:
        return y
    kept = math.exp(-ratio)
    behind = (after - before) / ratio
    return after - behind + (y - before + behind) * kept


@compiled
def respond(p: Record, s: Record, own: Record, h: float) -> None:
    """Advance beam and sensor by a part of a hold whose relays have settled."""
    e = p.effects
    bent = deflection_at(p.deflection, s.temperature - p.heating.ambient, s.structural)
    if h > 0.0 and e.swing_share != 0.0:
        swing(own, bent, h, 2.0 * math.pi * e.swing_frequency, e.swing_damping)
    own.bent = bent
    film = resistance_at(p.resistance, s.temperature, s.electrical)
    film *= (1.0 + e.ageing * (own.time - own.ageing_from)) * (1.0 - e.gain_loss)
    film += e.leak * own.acting
    own.reading = film if e.sensor_lag == 0.0 else trailing(own.reading, own.film, film, h / e.sensor_lag)
    own.film = film


@compiled
def swing(own: Record, bent: float, h: float, w: float, zeta: float) -> None:
    """Advance the beam's mode over a part in which its rest position moves linearly to `bent`; exact."""
    slope = (bent - own.bent) / h
    behind = 2.0 * zeta * slope / w
    x, v = own.swing - own.bent + behind, own.speed - slope
    wd = w * math.sqrt(1.0 - zeta * zeta)
    c, n, kept = math.cos(wd * h), math.sin(wd * h) / wd, math.exp(-zeta * w * h)
    own.swing = bent - behind + kept * (x * c + (v + zeta * w * x) * n)
    own.speed = slope + kept * (v * c - (w * w * x + zeta * w * v) * n)


# 11 parameters because a kernel takes its arrays one by one
@compiled
def hold_domains_with_effects(  # noqa: PLR0913
    parameters: Array,
    state: Array,
    current_mA: float,
    dt_s: float,
    owns: Array,
    queue: Floats,
    t_up: Floats,
    t_down: Floats,
    by_t_down: Array,
    is_up: Array,
    counters: Array,
) -> None:
    """Hold a current on a device whose film is a population of domains."""
    p, s, own = parameters[0], state[0], owns[0]
    command(own, queue, np.float64(np.float32(current_mA)))
    s.unread += dt_s
    coupling, e, m = p.hysteresis.coupling, ELECTRICAL, STRUCTURAL
    left = dt_s
    while left > SAME_S:
        h = part_of_hold(p, own, queue, left)
        warm(p, s, own, h)
        s.electrical = settle(t_up[e], t_down[e], by_t_down[e], is_up[e], counters[e], own.seen, coupling)
        s.structural = settle(t_up[m], t_down[m], by_t_down[m], is_up[m], counters[m], own.seen, coupling)
        respond(p, s, own, h)
        left -= h


@compiled
def hold_limiting_loop_with_effects(
    parameters: Array,
    state: Array,
    current_mA: float,
    dt_s: float,
    owns: Array,
    queue: Floats,
    memory: Floats,
) -> None:
    """Hold a current on a device whose film follows limiting loops."""
    p, s, own = parameters[0], state[0], owns[0]
    command(own, queue, np.float64(np.float32(current_mA)))
    s.unread += dt_s
    left = dt_s
    while left > SAME_S:
        h = part_of_hold(p, own, queue, left)
        warm(p, s, own, h)
        s.electrical = follow(p.hysteresis.electrical, memory[ELECTRICAL], own.seen)
        s.structural = follow(p.hysteresis.structural, memory[STRUCTURAL], own.seen)
        respond(p, s, own, h)
        left -= h


@compiled
def outputs_with_effects(parameters: Array, owns: Array) -> tuple[float, float]:
    """Return what reaches the instruments: resistance [ohm], deflection [um]."""
    p, own = parameters[0], owns[0]
    return own.reading, own.bent + p.effects.swing_share * (own.swing - own.bent)


@compiled
def read_with_effects(
    parameters: Array, state: Array, owns: Array, normals: Floats, row: int
) -> tuple[float, float]:
    """Return both instruments' readings [ohm], [um]; consume a row of `normals`."""
    p, s = parameters[0], state[0]
    resistance, deflection = outputs_with_effects(parameters, owns)
    flicker = drift(s.flicker, normals[row], s.unread)
    s.unread = 0.0
    white = (1.0 + p.effects.noise_growth) * normals[row, WHITE]
    return (
        read_resistance(p.sensing, resistance, flicker, white),
        read_deflection(p.sensing, deflection, normals[row, REFERENCE]),
    )


def at_rest(step_s: float, ambient_degC: float, resistance_ohm: float, deflection_um: float) -> Array:
    """Return the state at power-up."""
    own = np.zeros(1, dtype=OWN)
    own["step"], own["seen"] = step_s, ambient_degC
    own["cold"] = own["film"] = own["reading"] = resistance_ohm
    own["bent"] = own["swing"] = deflection_um
    return own
