"""The heat balance and the loops' input, one substep after the other; see `rtctl.simulations.vo2.heat`."""

from __future__ import annotations

import math
from typing import Any

from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.model import preisach_step
from rtctl.simulations.vo2.heat import (
    Powers,
    Step,
    advance,
    cool,
    drifted_s,
    first_temperature,
    loop_current,
    phase_at,
    settle_film,
    stored,
    surrogate_power,
)
from rtctl.simulations.vo2.mechanism import Balance
from rtctl.simulations.vo2.mechanisms.actuation.deadband import command_for
from rtctl.simulations.vo2.relaxation import relax, turn
from rtctl.simulations.vo2.stepping.values import Constants, Parameters

Record = Any


def balance_of(p: Parameters) -> Balance:
    """Return the constants of the heat balance."""
    tcr, loss, latent, sensing, heating = (
        p.tcr, p.nonlinear_loss, p.latent_heat, p.self_heating, p.phase_heating,
    )  # fmt: skip
    second, drift = p.second_time_constant, p.ambient_drift
    return Balance(
        p.nominal.time_constant, second.share, second.time_constant, tcr.tcr, tcr.known * tcr.tcr, loss.loss,
        loss.known * loss.loss, (1.0 - latent.film) * latent.heat, sensing.heat, sensing.known * sensing.heat,
        p.rate_dependence.time_constant, 0.0, latent.film * latent.heat, 0.0, p.deadband.zone, heating.growth,
        heating.known * heating.growth, drift.rate, drift.settling_time,
    )  # fmt: skip


@kernel
def surrogate(power: float) -> float:
    """Return the current [mA] that would hold a temperature; 0 below that of no current."""
    return math.sqrt(max(power, 0.0))


@kernel
def as_loops(power: float, zone: float) -> float:
    """Return a surrogate [mA^2] as the loops know it, which refer to the whole current; see `as_current`."""
    if zone == 0.0:
        return power
    held = surrogate(power) + zone
    return held * held + min(power, 0.0)


def rest(s: Record, current: float, p: Parameters, c: Constants) -> None:
    """Set the film at rest in a heating current [mA], heated from cold."""
    b = balance_of(p)
    cool(s.heat_film, c.resistance)
    cool(s.heat_beam, c.deflection)
    T = first_temperature(current * current, s.heat_film, c.cold, b, c.resistance)
    settle_film(s.heat_beam, T, b, c.deflection)
    settle_film(s.heat_film, T, b, c.resistance)
    s.main, s.second, s.T, s.warm, s.late, s.capacity = T, T, T, T, T, 1.0
    s.phase = phase_at(T, s.heat_beam, b, c.deflection)
    s.stored = stored(T, s.phase, s.heat_film, c.cold, b, c.resistance)
    s.power = as_loops(surrogate_power(T, b), b.zone)
    s.lagging = s.power
    cool(s.film, c.resistance)
    cool(s.beam, c.deflection)
    s.turn[0], s.turn[1] = surrogate(s.power), 1.0
    follow(s, s.power, p, c)


def follow(s: Record, power: float, p: Parameters, c: Constants) -> None:
    """Move the loops' relays to a temperature, as the surrogate's square [mA^2]."""
    v, back = surrogate(power), p.deadband.behind * p.deadband.width
    if back > 0.0:
        v = command_for(v, s.turn, back)
    preisach_step(s.film, v, c.resistance)
    preisach_step(s.beam, v, c.deflection)


def warm_up(s: Record, powers: Powers, h: float, b: Balance, p: Parameters, c: Constants) -> None:
    """Advance heat and loops by a substep of h [s]."""
    halfway = b.drift * drifted_s(s.time_s + 0.5 * h, b.settling_s)
    drift = b.drift * drifted_s(s.time_s + h, b.settling_s)
    step = Step(s.main, s.second, s.T, s.T, s.capacity, s.stored, s.phase)
    step = advance(step, powers, drift, h, s.heat_beam, s.heat_film, c.cold, b, c.deflection, c.resistance)
    s.main, s.second, s.T, s.capacity, s.stored, s.phase = (
        step.main, step.second, step.T, step.capacity, step.stored, step.phase,
    )  # fmt: skip
    before, warm, middle = float(s.warm), step.T + drift, step.half + halfway
    s.warm = warm
    power = surrogate_power(warm, b)
    if b.latent != 0.0:
        preisach_step(s.heat_beam, loop_current(power, b), c.deflection)
    if b.self_heating != 0.0 or b.film_heat != 0.0 or b.phase_heating != 0.0:
        preisach_step(s.heat_film, loop_current(power, b), c.resistance)
    s.power = as_loops(power, b.zone)
    if b.lag_s == 0.0:
        s.late, s.lagging = warm, s.power
        follow(s, s.lagging, p, c)
        return
    peak = turn(s.late, before, middle, warm, h, b.lag_s)
    s.late = relax(s.late, before, middle, warm, h, b.lag_s)
    if not math.isnan(peak):
        follow(s, as_loops(surrogate_power(peak, b), b.zone), p, c)
    s.lagging = as_loops(surrogate_power(s.late, b), b.zone)
    follow(s, s.lagging, p, c)
