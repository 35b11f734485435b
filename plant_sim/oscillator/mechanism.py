"""A mechanism's contributions to an oscillator: to the drive, to the equation of motion, or to the reading.

A mechanism is one file: its declaration and one or more of these contributions. In the order in which a signal
passes them: `input` (the drive between its samples), `drive` (the drive at the integrator's instants), `terms` or
`memory` (the equation), `sensor` (the reading).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from plant_sim.oscillator.kinks import Kinks
from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.mechanisms import Mechanism, Parameter
from rtctl.border.units.quantities import convert, is_angle

Values = Mapping[str, float]
"""Values of one mechanism by parameter name, in the units of the data."""


class Sampled(NamedTuple):
    """The drive as it was sampled, and its assumed course between samples."""

    samples: FloatArray
    """Drive (n,) at the samples."""
    period_s: float
    hold: str
    delay_s: float = 0.0
    blend: tuple[tuple[str, float], ...] = ()
    """Other holds and their weights; the rest of the weight is that of `hold`."""
    onward: FloatArray = np.empty(0)
    """Drive (m,) after `samples`: a band-limited drive before its last sample depends on what came then."""
    within: bool = False
    """Whether a jump within a step stays between its levels: a law that is not linear follows."""


class Driven(NamedTuple):
    """The drive at the instants of the integrator."""

    nodes: FloatArray
    """Drive (steps, 3) at start, middle and end of each step."""
    step_s: float


class Moved(NamedTuple):
    """The motion at the samples, or at instants between them too, and the drive that made it."""

    displacement: FloatArray
    """Displacement (samples,) that the sensor would read, or whichever response it reads; mechanisms replace it."""
    velocity: FloatArray
    """Its time derivative."""
    time_s: FloatArray
    """Time since the first sample [s]."""
    period_s: float
    drive: Driven
    substeps: int
    derivatives: int = 0
    """Time derivatives of the displacement that the sensor reads; 0: it reads the displacement itself."""
    shared: dict[Any, Any] | None = None
    """Results for another lane under the same drive; None: nothing is kept."""
    filtered_slope: FloatArray | None = None
    """Rate (samples,) of a `displacement` that is filtered; None: it is `velocity`."""
    kinks: Kinks | None = None
    """Where it has kinks; None: nowhere."""

    @property
    def slope(self) -> FloatArray:
        """Return the rate (samples,) of `displacement`, from which readings between samples follow."""
        return self.velocity if self.filtered_slope is None else self.filtered_slope

    def once(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return `make()`, which depends on the drive, the time and `key` alone: computed once for all lanes."""
        if self.shared is None:
            return make()
        if key not in self.shared:
            self.shared[key] = make()
        return self.shared[key]


class Memory(NamedTuple):
    """A law with states of its own; see `plant_sim.oscillator.equation.memory`."""

    law: Any
    states: int
    constants: Callable[[Values], tuple[float, ...]]
    """Returns the rows that the law reads, in its order."""
    acts: Callable[[Values], bool] = lambda values: True
    """Returns whether it acts at these values of its mechanism, which may act elsewhere alone."""
    start: Callable[[float, float], tuple[float, ...]] | None = None
    """Returns the states at the start of a record from displacement and velocity there; None: all zero."""
    step: int | None = None
    """Which of its constants is the integrator's step [s], written there by it; None: none."""
    damping: Any = None
    """Law of a damper that acts at some places alone, whose force the law leaves out; None: there is none."""
    simpler: Any = None
    """Law, without `damping`, that is the same where `is_simple` holds, and cheaper; None: there is none."""
    is_simple: Callable[[Values], bool] = lambda values: False
    """Returns whether `simpler` is the same law at these values."""

    def at(self, lanes: Sequence[Values]) -> Memory:
        """Return the memory with the cheapest law for the values of all lanes."""
        simple = self.simpler is not None and all(self.is_simple(lane) for lane in lanes)
        return self._replace(law=self.simpler, damping=None) if simple else self


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorMechanism(Mechanism):
    """A mechanism with its contributions; all others are None or empty."""

    input: Callable[[Sampled, Values], Sampled] | None = None
    drive: Callable[[Driven, Values], Driven] | None = None
    terms: Mapping[str, str | Callable[[Values], float]] = field(default_factory=dict)
    """Row of `plant_sim.oscillator.equation.terms` -> parameter, or function of all of them, that is added to it."""
    memory: Memory | None = None
    sensor: Callable[[Moved, Values], Moved] | None = None
    bends: bool = False
    """Whether its law of the drive is not linear."""
    looks_between: bool = False
    """Whether a sensor's reading depends on the motion between samples: it is given more instants then."""
    unread: Callable[[float, Values], float] | None = None
    """Returns a displacement at rest from a sensor's reading; None: the reading itself."""
    fastest_rate: Callable[[Values, float], float] = lambda values, speed: 0.0
    """Angular frequency [1/s] that it adds (in squares) to what the integrator must resolve, at speeds up to `speed`;
    of a relaxation `RELAXATION` times its rate."""
    transition: Callable[[Values], tuple[float, float] | None] = lambda values: None
    """Change of the velocity within which its force changes as the motion turns, and that force: steps resolve it."""
    stage: int = 0
    """Order among mechanisms that act at the same place: lower ones first."""
    transfer: Callable[[ComplexArray, Values], ComplexArray] | None = None
    """Returns the factor on a drive or a reading of complex angular frequency s = 2 pi i f [1/s] in the steady state;
    None: in the steady state it does what it does in a record."""
    beside: Callable[[ComplexArray, int, Values], ComplexArray] | None = None
    """Returns what is read beside the motion, over the drive, at complex angular frequency s [1/s], by a sensor of so
    many derivatives of the displacement; None: nothing."""
    in_steady_state: bool = True
    """Whether the amplitude and phase of the response to a sine show it."""

    @property
    def acts_before_the_equation(self) -> bool:
        """Whether it changes the drive: lanes with different values cannot share one."""
        return self.input is not None or self.drive is not None


RELAXATION = 0.25
"""A relaxation of rate 1/s needs the step of an oscillation of so many rad/s: a tenth of its time constant."""


def coefficient(name: str, unit: str, meaning: str, scale: Any, **more: Any) -> Parameter:
    """Return a parameter that switches its mechanism off at zero."""
    return Parameter(name=name, unit=unit, meaning=meaning, scale=scale, neutral=0.0, **more)


def shape(name: str, unit: str, meaning: str, scale: Any, **more: Any) -> Parameter:
    """Return a parameter for how a mechanism acts; positive unless `low` says otherwise."""
    return Parameter(
        name=name, unit=unit, meaning=meaning, scale=scale, neutral=None, **{"low": 1e-9, **more}
    )


def in_units(mechanism: OscillatorMechanism, units: Mapping[str, str]) -> OscillatorMechanism:
    """Return `mechanism` with its defaults in the data's `units` of "drive" and "displacement".

    A default of one radian becomes 57.3 where the displacement is in degrees, and None where it is in mm: it has to be
    given there (`Mechanism.suits_data`).
    """
    if not any(parameter.default_unit for parameter in mechanism.parameters):
        return mechanism
    z, u = units["displacement"], units["drive"]
    bound = [
        replace(one, default=_converted(one.default, one.default_unit, one.unit_in(z=z, u=u)))
        if one.default_unit and one.default is not None
        else one
        for one in mechanism.parameters
    ]
    return replace(mechanism, parameters=tuple(bound))


@lru_cache(maxsize=64)
def _converted(value: float, unit: str, to: str) -> float | None:
    """Return `value` [unit] in `to`; None where that is no such unit. An angle is no plain number."""
    if is_angle(unit) != is_angle(to):
        return None
    try:
        return convert(value, unit, to)
    except ValueError:
        return None
