"""From the loops' read-outs at an instant to the readings: film, beam, instruments, in the order of a simulation.

What lags is linear from one instant to the next. An instant is kept once it is known which current follows on it: until
then its readings are computed without a change of the memory, as often as they are asked for.
"""

from __future__ import annotations

import math
from typing import Any

from rtctl.arithmetic.elementary import exp, expm1, floor, log, sin
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.model import output_at
from rtctl.simulations.vo2.heat import drifted_s, temperature_at
from rtctl.simulations.vo2.mechanism import Balance
from rtctl.simulations.vo2.mechanisms.actuation.structure_resonance import swing_over
from rtctl.simulations.vo2.mechanisms.hysteresis.creep import A_DECADE, DECADES
from rtctl.simulations.vo2.mechanisms.hysteresis.shape import RADIUS, branch_centre
from rtctl.simulations.vo2.mechanisms.sensor.ageing import slowed_s
from rtctl.simulations.vo2.phases import Phases, mixed, switched
from rtctl.simulations.vo2.stepping.balance import balance_of, surrogate
from rtctl.simulations.vo2.stepping.heater import about
from rtctl.simulations.vo2.stepping.values import Constants, Parameters

Record = Any
LN10, PI = 2.302585092994046, 3.141592653589793


@kernel
def missed_now(missed: float, last: float, value: float, h: float, tau: float) -> float:
    """Return by how much a lag is ahead of a value, h [s] after it missed the last one by `missed`; 0 at the start."""
    if h == 0.0:
        return 0.0
    lost = -expm1(-h / tau)
    return missed * (1.0 - lost) - tau / h * lost * (value - last)


# 8 parameters because a creep is told by three numbers besides its share and the time
@kernel
def crept(  # noqa: PLR0913
    missed: FloatArray, last: float, value: float, h: float, rate: float, onset: float, end: float, store: bool
) -> float:  # fmt: skip
    """Return what a share that creeps lacks; see `hysteresis.creep`. `store` advances its relaxations, in place."""
    total, width = 0.0, log(max(end / onset, 1.0)) / LN10 * A_DECADE
    for j in range(A_DECADE * DECADES + 1):
        weight = min(1.0, max(0.0, width + 1.0 - j)) / A_DECADE
        if weight > 0.0 or store:
            now = missed_now(missed[j], last, value, h, onset * exp(j * LN10 / A_DECADE))
            total += weight * now
            if store:
                missed[j] = now
    return rate * total


@kernel
def nearest(reading: float, step: float, level: float) -> float:
    """Return the level that is nearest to a reading; no step, no levels."""
    return level + step * floor((reading - level) / step + 0.5) if step > 0.0 else reading


@kernel
def harmonics(first: float, side: float, second: float, side_second: float, branch: float, x: float) -> float:
    """Return the correction of a read-out; see `hysteresis.shape`."""
    once, twice = sin(PI * x), sin(2.0 * PI * x)
    return (first + side * branch) * once + (second + side_second * branch) * twice


def phases_at(activation: float, mixing: float, b: Balance, c: Constants) -> Phases:
    """Return the phases of the film."""
    coldest, hottest = temperature_at(c.low * c.low, b), temperature_at(c.high * c.high, b)
    return Phases(c.cold, c.metal, coldest, hottest, activation, mixing)


def film_and_beam(
    s: Record, h: float, store: bool, b: Balance, p: Parameters, c: Constants
) -> tuple[float, float]:
    """Return -ln R of the film and the deflection of a beam without mass [um]."""
    reading = output_at(s.film, int(s.film[0]), c.resistance)
    bent = output_at(s.beam, int(s.beam[0]), c.deflection)
    T, late = temperature_at(s.power, b), temperature_at(s.lagging, b)
    ambient, shape, rate, creep = p.ambient_drift, p.shape, p.rate_dependence, p.creep
    x = min(max((surrogate(s.power) - c.low) / (c.high - c.low), 0.0), 1.0)
    centre = branch_centre(s.centre, x, RADIUS)
    branch = (x - centre) / RADIUS
    reading -= harmonics(
        shape.resistance_first, shape.resistance_side, shape.resistance_second, shape.resistance_side_second, branch, x
    )  # fmt: skip
    bent += harmonics(
        shape.deflection_first, shape.deflection_side, shape.deflection_second, shape.deflection_side_second, branch, x
    )  # fmt: skip
    if ambient.rate != 0.0:
        limits = phases_at(ambient.activation, 0.0, b, c)
        below, above = min(T - limits.coldest, 0.0), max(T - limits.hottest, 0.0)
        reading += ambient.activation * below
        bent -= ambient.expansion * (below + above)
    if rate.time_constant != 0.0:
        lagging = phases_at(rate.activation, rate.mixing, b, c)
        reading = mixed(switched(reading, late, lagging), T, lagging)
        bent -= rate.expansion * (T - late)
    if c.creeps:
        creeping = phases_at(creep.activation, creep.mixing, b, c)
        film_share, beam_share = switched(reading, T, creeping), bent + creep.expansion * T
        lacks = crept(s.film_creep, s.film_share, film_share, h, creep.rate, creep.onset, creep.end, store)
        reading = mixed(film_share + lacks, T, creeping)
        bent += crept(s.beam_creep, s.beam_share, beam_share, h, creep.rate, creep.onset, creep.end, store)
        if store:
            s.film_share, s.beam_share = film_share, beam_share
    if store:
        s.centre = centre
    gained = about(reading, c.reading_middle, p.nominal.resistance_gain, -p.nominal.resistance_offset)
    return gained, about(bent, c.deflection_middle, p.nominal.deflection_gain, p.nominal.deflection_offset)


def swung(s: Record, bent: float, h: float, store: bool, p: Parameters) -> float:
    """Return the deflection of the beam with its mode [um]; see `structure.resonance`."""
    mode = p.resonance
    if mode.participation == 0.0:
        if store:
            s.bent, s.swing, s.speed = bent, bent, 0.0
        return bent
    q, speed = bent, 0.0
    if h > 0.0:
        swing = swing_over(s.swing, s.speed, s.bent, bent, h, 2.0 * PI * mode.frequency, mode.damping_ratio)
        q, speed = swing.q, swing.speed
    if store:
        s.bent, s.swing, s.speed = bent, q, speed
    return float(bent + mode.participation * (q - bent))


def sensed_ohm(s: Record, reading: float, h: float, after: float, store: bool, p: Parameters) -> float:
    """Return the resistance as the sensor reads it [ohm]; `after`: the current that follows on this instant [mA]."""
    aged = 1.0 + p.ageing.rate * slowed_s(s.time_s, p.ageing.slowing_time)
    ohm = exp(-reading) * (aged if aged > 0.0 else math.nan)
    leak = p.crosstalk
    if leak.leak != 0.0:
        current = leak.before * s.current + (1.0 - leak.before) * after
        ohm += leak.leak * (current - leak.known * surrogate(s.power))
    tau = p.lag.time_constant
    missed = missed_now(s.ohm_missed, s.ohm, ohm, h, tau) if tau > 0.0 else 0.0
    if store:
        s.ohm, s.ohm_missed = ohm, missed
    return ohm + missed


def sensed_um(s: Record, bent: float, h: float, store: bool, p: Parameters) -> float:
    """Return the deflection as the instrument reads it [um]."""
    tau, rate = p.deflection_lag.time_constant, p.highpass.rate
    missed = missed_now(s.seen_missed, s.seen, bent, h, tau) if tau > 0.0 else 0.0
    if store:
        s.seen, s.seen_missed = bent, missed
    D = bent + missed
    if rate == 0.0:
        if store:
            s.coupled, s.coupled_missed, s.coupled_first = D, 0.0, D
        return D
    missed = missed_now(s.coupled_missed, s.coupled, D, h, 1.0 / rate)
    first = D if s.begun == 0.0 else s.coupled_first
    left = exp(-rate * s.time_s)
    if store:
        s.coupled, s.coupled_missed, s.coupled_first = D, missed, first
    return float(-missed + first * (left + p.highpass.settled * (1.0 - left)))


def read(s: Record, h: float, after: float, store: bool, p: Parameters, c: Constants) -> None:
    """Set the readings of the last instant, h [s] after the one that was kept last; `store` keeps this one too."""
    b = balance_of(p)
    reading, bent = film_and_beam(s, h, store, b, p, c)
    bent = sensed_um(s, swung(s, bent, h, store, p), h, store, p)
    ohm = sensed_ohm(s, reading, h, after, store, p)
    bent += p.drift.rate * drifted_s(s.time_s, p.drift.settling_time)
    s.resistance = nearest(ohm, p.quantisation.resistance, p.quantisation.resistance_level)
    s.deflection = nearest(bent, p.quantisation.deflection, p.quantisation.deflection_level)
