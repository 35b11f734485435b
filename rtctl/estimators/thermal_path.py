"""An extended model, one held current after the other: heat, film, beam and their readings.

The heat balance, the relays and their order are those of `rtctl.simulations.vo2`; here they keep their state from one
sample to the next. State order: T_1, T_2, T, capacity, heat stored [mA^2]; the film's T in a room that drifts, what the
relays see of it [mA^2]; R as it reaches the sensor, R as it is read [ohm]; D of the beam without mass, q [um],
q' [um/s]; where the loops turned last [mA], and which way they go. Beside it the stacks of -ln R and of deflection.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.model import PreisachParams, cooled_stack, preisach_step
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.heat import (
    Powers,
    Step,
    advance,
    drifted_s,
    first_temperature,
    heating_power,
    loop_current,
    phase_at,
    stored,
    surrogate_power,
    temperature_at,
)
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics
from rtctl.simulations.vo2.mechanism import Balance
from rtctl.simulations.vo2.mechanisms.actuation.deadband import command_for
from rtctl.simulations.vo2.mechanisms.actuation.structure_resonance import swing_over
from rtctl.simulations.vo2.mechanisms.sensor.ageing import slowed_s
from rtctl.simulations.vo2.phases import Phases, mixed, switched
from rtctl.simulations.vo2.relaxation import relax, turn

STATES = 14
NO_SHARPNESS = 0.0
"""The phase at the start of a step counts only if its sharpness does, which no named mechanism changes."""
WARM, SEEN, FILM, READ, BENT, SWING, SPEED, TURNED, WAY = 5, 6, 7, 8, 9, 10, 11, 12, 13


class PathParams(NamedTuple):
    """Parameters of the kernels besides the Preisach models; names as in `Vo2Dynamics`."""

    balance: Balance
    phases: Phases
    expansion: float
    cold: float
    """-ln of the cold film's resistance [ohm]."""
    substep_s: float
    reading_gain: float
    reading_offset: float
    deflection_gain: float
    deflection_offset: float
    ageing: float
    ageing_slowing_s: float
    leak: float
    leak_known: float
    sensor_lag_s: float
    participation: float
    rate: float
    """Angular frequency of the beam's mode [rad/s]."""
    damping_ratio: float
    back: float
    """Half of the backlash that the loops hold [mA]."""


def path_params(model: Vo2Model, dynamics: Vo2Dynamics) -> PathParams:
    """Return the parameters of a model."""
    numbers = (
        dynamics.expansion, -math.log(model.resistance.high), dynamics.substep_s, *dynamics.reading,
        *dynamics.deflection, dynamics.ageing, dynamics.ageing_slowing_s, dynamics.leak, dynamics.leak_known,
        dynamics.sensor_lag_s, dynamics.participation, 2.0 * math.pi * dynamics.frequency_hz, dynamics.damping_ratio,
        dynamics.behind * dynamics.deadband_mA,
    )  # fmt: skip
    balance, phases = Balance(*map(float, dynamics.balance)), Phases(*map(float, dynamics.phases))
    return PathParams(balance, phases, *map(float, numbers))


@kernel
def substeps(duration_s: float, longest_s: float) -> int:
    """Return in how many substeps of at most `longest_s` [s], but for rounding, a time is taken."""
    whole = duration_s / longest_s - 1e-9
    count = int(whole)
    return max(1, count + 1 if whole > count else count)


@kernel
def surrogate_at(T: float, balance: Balance) -> float:
    """Return the v [mA] at which the identified loops have a temperature T [mA^2]."""
    return loop_current(surrogate_power(T, balance), balance)


@kernel
def swing_step(x: FloatArray, bent: float, h: float, rate: float, ratio: float) -> None:
    """Return the beam's mode after h [s] over which its rest position moves linearly to `bent`; exact.

    See `structure.resonance`.
    """
    swing = swing_over(x[SWING], x[SPEED], x[BENT], bent, h, rate, ratio)
    x[SWING], x[SPEED] = swing.q, swing.speed


@kernel
def sensed_film(reading: float, v: float, current: float, time_s: float, p: PathParams) -> float:
    """Return the resistance at the sensor [ohm] for the loops' -ln R."""
    aged = 1.0 + p.ageing * slowed_s(time_s, p.ageing_slowing_s)
    return aged * exp(-(p.reading_gain * reading + p.reading_offset)) + p.leak * (current - p.leak_known * v)


@kernel
def path_start(
    x: FloatArray, film: FloatArray, beam: FloatArray, current: float, p: PathParams, r: PreisachParams,
    d: PreisachParams,
) -> None:  # fmt: skip
    """Start at rest at a heating current, from a full cooling: all three in place, the stacks all off before."""
    power = heating_power(current, p.balance)
    T = first_temperature(power, film, p.cold, p.balance, r)
    s = surrogate_power(T, p.balance)
    v = loop_current(s, p.balance)
    x[0] = x[1] = x[2] = T
    x[3], x[WARM], x[SEEN] = 1.0, T, T
    x[TURNED], x[WAY] = v, 1.0
    there = v + p.back
    reading, bent = preisach_step(film, there, r).y, preisach_step(beam, there, d).y
    x[4] = stored(T, phase_at(T, beam, p.balance, d), film, p.cold, p.balance, r)
    x[FILM] = x[READ] = sensed_film(reading, v, current, 0.0, p)
    x[BENT] = x[SWING] = p.deflection_gain * bent + p.deflection_offset
    x[SPEED] = 0.0


# 10 parameters because a kernel takes its arrays one by one
@kernel
def path_step(  # noqa: PLR0913
    x: FloatArray, film: FloatArray, beam: FloatArray, current: float, heat: float, time_s: float, duration_s: float,
    p: PathParams, r: PreisachParams, d: PreisachParams,
) -> None:  # fmt: skip
    """Hold a heating current; advance the state and the stacks in place.

    Args:
        x: state.
        film: relays of the resistance model.
        beam: relays of the deflection model.
        current: heating current [mA].
        heat: heat besides the current's [mA^2].
        time_s: time at the start [s].
        duration_s: how long the current is held [s].
        p: parameters.
        r: parameters of the resistance model.
        d: parameters of the deflection model.
    """
    count = substeps(duration_s, p.substep_s)
    h = duration_s / count
    power = heating_power(current, p.balance) + heat
    powers = Powers(power, power, power, power)
    step = Step(x[0], x[1], x[2], x[2], x[3], x[4], NO_SHARPNESS)
    lag_s = p.balance.lag_s
    for k in range(count):
        drift = p.balance.drift * drifted_s(time_s + (k + 1) * h, p.balance.settling_s)
        halfway = p.balance.drift * drifted_s(time_s + (k + 0.5) * h, p.balance.settling_s)
        step = advance(step, powers, drift, h, beam, film, p.cold, p.balance, d, r)
        before, middle, warm = x[WARM], step.half + halfway, step.T + drift
        peak = turn(x[SEEN], before, middle, warm, h, lag_s)
        seen = relax(x[SEEN], before, middle, warm, h, lag_s)
        if lag_s > 0.0 and not math.isnan(peak):
            at_peak = command_for(surrogate_at(peak, p.balance), x[TURNED:], p.back)
            preisach_step(film, at_peak, r)
            preisach_step(beam, at_peak, d)
        x[WARM], x[SEEN] = warm, seen
        v = surrogate_at(warm, p.balance)
        w = command_for(surrogate_at(seen, p.balance), x[TURNED:], p.back)
        reading, bent = preisach_step(film, w, r).y, preisach_step(beam, w, d).y
        if lag_s > 0.0:
            reading = mixed(switched(reading, seen, p.phases), warm, p.phases)
            bent -= p.expansion * (warm - seen)
        ohm = sensed_film(reading, v, current, time_s + (k + 1) * h, p)
        x[READ] = relax(x[READ], x[FILM], 0.5 * (x[FILM] + ohm), ohm, h, p.sensor_lag_s)
        x[FILM] = ohm
        bent = p.deflection_gain * bent + p.deflection_offset
        if p.participation != 0.0:
            swing_step(x, bent, h, p.rate, p.damping_ratio)
        x[BENT] = bent
    x[0], x[1], x[2], x[3], x[4] = step.main, step.second, step.T, step.capacity, step.stored


# 9 parameters because it takes those of `path_step` but for the heat
@kernel
def reached(  # noqa: PLR0913
    x: FloatArray, film: FloatArray, beam: FloatArray, power: float, time_s: float, duration_s: float, p: PathParams,
    r: PreisachParams, d: PreisachParams,
) -> float:  # fmt: skip
    """Return what the relays would see after a time at a constant power [mA^2]; nothing advances.

    Args:
        x: state.
        film: relays of the resistance model.
        beam: relays of the deflection model.
        power: the constant power [mA^2].
        time_s: time at the start [s].
        duration_s: how long the power is held [s].
        p: parameters.
        r: parameters of the resistance model.
        d: parameters of the deflection model.
    """
    count = substeps(duration_s, p.substep_s)
    h = duration_s / count
    powers = Powers(power, power, power, power)
    step = Step(x[0], x[1], x[2], x[2], x[3], x[4], NO_SHARPNESS)
    warm, seen = float(x[WARM]), float(x[SEEN])
    for k in range(count):
        drift = p.balance.drift * drifted_s(time_s + (k + 1) * h, p.balance.settling_s)
        halfway = p.balance.drift * drifted_s(time_s + (k + 0.5) * h, p.balance.settling_s)
        step = advance(step, powers, drift, h, beam, film, p.cold, p.balance, d, r)
        before, middle, warm = warm, step.half + halfway, step.T + drift
        seen = relax(seen, before, middle, warm, h, p.balance.lag_s)
    return surrogate_power(seen, p.balance)


# 7 parameters because a kernel takes its arrays one by one
def settle_path(
    x: FloatArray, film: FloatArray, beam: FloatArray, power: float, p: PathParams, r: PreisachParams,
    d: PreisachParams,
) -> None:  # fmt: skip
    """Set all temperatures of a path to that of a surrogate's power [mA^2], with the relays as they are."""
    T = temperature_at(power, p.balance)
    x[:3] = x[WARM] = x[SEEN] = T
    x[3], x[4] = 1.0, stored(T, phase_at(T, beam, p.balance, d), film, p.cold, p.balance, r)


class ThermalPath:
    """A model with its state, for a current that has passed delay and dead band already."""

    def __init__(self, model: Vo2Model, params: PathParams) -> None:
        self.params = params
        self._r, self._d = model.resistance_preisach.params, model.deflection_preisach.params
        self.x = np.zeros(STATES)
        self.film, self.beam = cooled_stack(self._r.grid), cooled_stack(self._d.grid)

    def start(self, current: float) -> None:
        """Start at rest at a heating current [mA], from a full cooling."""
        self.film[:], self.beam[:] = cooled_stack(self._r.grid), cooled_stack(self._d.grid)
        path_start(self.x, self.film, self.beam, current, self.params, self._r, self._d)

    def step(self, current: float, heat: float, time_s: float, duration_s: float) -> None:
        """Hold a heating current [mA] and heat [mA^2] beside it."""
        path_step(
            self.x, self.film, self.beam, current, heat, time_s, duration_s, self.params, self._r, self._d
        )

    def power_of(self, current: float) -> float:
        """Return the power of a heating current [mA], in mA^2."""
        return float(heating_power(current, self.params.balance))

    def current_of(self, power: float) -> float:
        """Return the heating current [mA] of a power [mA^2]."""
        return float(loop_current(power, self.params.balance))

    @property
    def resistance(self) -> float:
        """The resistance as it is read [ohm]."""
        return float(self.x[READ])

    @property
    def deflection(self) -> float:
        """The deflection as it is measured [um]."""
        return float(self.x[BENT]) + self.swing

    @property
    def swing(self) -> float:
        """How far the beam swings beyond where it settles at this temperature [um]."""
        return float(self.params.participation * (self.x[SWING] - self.x[BENT]))
