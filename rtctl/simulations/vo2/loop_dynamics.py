"""Dynamics of an extended VO2 model in the loop: its mechanisms and corrections as numbers.

The heat balance is the simulation's (`rtctl.simulations.vo2.heat`); the rest are the instruments and the drive around
it. `used` names the mechanisms with a place in the loop, `left_out` those without one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2 import vo2_simulation
from rtctl.simulations.vo2.heat import phases_of
from rtctl.simulations.vo2.mechanism import Balance
from rtctl.simulations.vo2.mechanisms import MECHANISMS
from rtctl.simulations.vo2.nominal import middle, middle_reading
from rtctl.simulations.vo2.phases import Phases

LEFT_OUT = {
    "hysteresis.creep": "slower than the heat that the observer follows",
    "hysteresis.shape": "identify the loops anew instead",
    "sensor.deflection_lag": "the loop has no instrument of the deflection",
    "sensor.highpass": "the loop has no instrument of the deflection",
    "sensor.drift": "the loop has no instrument of the deflection",
    "sensor.quantisation": "within the noise that the observer expects",
    "input.gain_drift": "the loop does not know how long the drift has gone on",
    "timing.skew": "the loop reads at instants of its own",
}
"""Mechanisms without a place in the loop, and why."""
NOT_TRUSTED = {
    "structure.resonance": "in the observer only: the controller answers where the beam settles, without its swing",
}
"""Mechanisms with which tuning and feedforward made the loop track worse than without, and why."""


class Affine(NamedTuple):
    """Affine map x' = gain x + offset."""

    gain: float = 1.0
    offset: float = 0.0

    def of(self, x: float) -> float:
        """Return x' of x."""
        return self.gain * x + self.offset

    def back(self, x: float) -> float:
        """Return x of x'."""
        return (x - self.offset) / self.gain


UNCHANGED = Affine()


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Dynamics:
    """Dynamics between command and readings; s, mA, mA^2, ohm and um."""

    balance: Balance
    phases: Phases
    """Phases of the film, with the part that does not lag where the relays do."""
    expansion: float = 0.0
    """Thermal expansion [um/mA^2]."""
    current: Affine = UNCHANGED
    """Map from commanded to heating current, of which `balance.zone` does not heat."""
    reading: Affine = UNCHANGED
    """Map from -ln R of the loops to that of the film."""
    deflection: Affine = UNCHANGED
    delay_s: float = 0.0
    deadband_mA: float = 0.0
    behind: float = 1.0
    hold_mA: float = 0.0
    held: float = 0.0
    """Share of changes within `hold_mA` that is ignored."""
    ageing: float = 0.0
    """Ageing rate [1/s]."""
    ageing_slowing_s: float = 0.0
    """Time after which ageing slows down [s]; 0: it does not."""
    leak: float = 0.0
    """Crosstalk of the heater's current [ohm/mA]."""
    leak_known: float = 1.0
    sensor_lag_s: float = 0.0
    participation: float = 0.0
    frequency_hz: float = 0.0
    damping_ratio: float = 0.0
    used: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def is_plain(self) -> bool:
        """Whether the loop of a nominal model is enough."""
        return not self.used

    @property
    def substep_s(self) -> float:
        """Substep [s] that resolves the heating and all that follows it."""
        times = [self.balance.time_constant_s, self.balance.lag_s, self.sensor_lag_s]
        times += [self.balance.second_time_constant_s] if self.balance.share != 0.0 else []
        times += [0.5 / self.frequency_hz] if self.participation != 0.0 else []
        return min(time for time in times if time > 0.0) / 8.0


def dynamics_of(model: Vo2Model) -> Vo2Dynamics:
    """Return the dynamics of a model. Raises InputError where a mechanism or a number of it is unknown."""
    simulation = vo2_simulation(model, {}, "the model")
    found = {one.name: one.value for one in simulation.parameters}
    acting = {
        one.mechanism
        for one in simulation.parameters
        if one.declared.neutral is not None and one.value != one.declared.neutral and one.mechanism
    }
    balance = Balance(model.time_constant_s)
    for mechanism in simulation.mechanisms:
        if mechanism.id in acting and mechanism.balance is not None:
            own = {
                one.declared.name: one.value for one in simulation.parameters if one.mechanism == mechanism.id
            }
            balance = mechanism.balance(balance, own)

    def of(mechanism: str, name: str, otherwise: float = 0.0) -> float:
        return found[f"{mechanism}.{name}"] if mechanism in acting else otherwise

    def turned(signal: str, about: float, sign: float = 1.0) -> Affine:
        gain = found[f"{signal}_gain"]
        return Affine(gain, (1.0 - gain) * about + sign * found[f"{signal}_offset"])

    late = "hysteresis.rate_dependence"
    shapes = {name: of(late, name) for name in ("activation", "mixing")}
    return Vo2Dynamics(
        balance=balance,
        phases=phases_of(model, balance).of(shapes),
        expansion=of(late, "expansion"),
        current=turned("current", middle(model.current)),
        reading=turned("resistance", middle_reading(model.resistance), -1.0),
        deflection=turned("deflection", middle(model.deflection)),
        delay_s=of("actuation.delay", "delay"),
        deadband_mA=of("actuation.deadband", "width"),
        behind=of("actuation.deadband", "behind", 1.0),
        hold_mA=of("actuation.deadband", "hold"),
        held=of("actuation.deadband", "held"),
        ageing=of("sensor.ageing", "rate"),
        ageing_slowing_s=of("sensor.ageing", "slowing_time"),
        leak=of("sensor.crosstalk", "leak"),
        leak_known=of("sensor.crosstalk", "known", 1.0),
        sensor_lag_s=of("sensor.lag", "time_constant"),
        participation=of("structure.resonance", "participation"),
        frequency_hz=of("structure.resonance", "frequency"),
        damping_ratio=of("structure.resonance", "damping_ratio"),
        used=(*(one for one in MECHANISMS if one in acting - LEFT_OUT.keys()), *model.corrections),
        left_out=tuple(one.id for one in simulation.mechanisms if one.id in LEFT_OUT or one.id not in acting),
    )


def loop_dynamics(model: Vo2Model) -> Vo2Dynamics:
    """Return the dynamics that tuning and feedforward use: `dynamics_of` without untrusted mechanisms."""
    kept = tuple(one for one in model.mechanisms if one.id not in NOT_TRUSTED)
    dropped = tuple(one.id for one in model.mechanisms if one.id in NOT_TRUSTED)
    found = dynamics_of(replace(model, mechanisms=kept))
    return replace(found, left_out=(*found.left_out, *dropped))
