"""What a mechanism does to an identified VO2 actuator: to its current, its heat, its film or its readings.

A mechanism is one file: its declaration and one or more contributions, here in the order in which a signal passes
them. Temperatures are surrogates: v [mA] is the constant current that would hold them, v^2 [mA^2] its power.
What a mechanism does at rest is part of the identified loops already, where they come from the same device: `known`
says how much of it they hold, all of it unless the data say otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Mechanism, Parameter, Scales
from rtctl.models.span import Span
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S
from rtctl.simulations.vo2.phases import Phases

Values = Mapping[str, float]
"""Of one mechanism, by parameter name."""
TYPICAL_TIME_S = NOMINAL_TIME_CONSTANT_S


class Commanded(NamedTuple):
    """The current as it was sampled [mA], and how it goes on between samples."""

    samples: FloatArray
    """(n,)"""
    period_s: float
    hold: str
    delay_s: float = 0.0
    onward: FloatArray = np.empty(0)
    """(m,) after `samples`: a band-limited current before its last sample depends on what came then."""


class Pieces(NamedTuple):
    """The current over pieces of each sample period, smooth within each."""

    nodes: FloatArray
    """(periods * pieces, 3): at start, middle, end of each piece [mA]."""
    durations_s: FloatArray
    """(pieces,), of one period."""


class Balance(NamedTuple):
    """Constants of the heat balance; see `heat`. All but the time constant are 0 in the nominal model."""

    time_constant_s: float
    share: float = 0.0
    """Of the second part."""
    second_time_constant_s: float = 1.0
    tcr: float = 0.0
    """1/mA^2"""
    tcr_known: float = 0.0
    loss: float = 0.0
    """1/mA^2"""
    loss_known: float = 0.0
    latent: float = 0.0
    """mA^2"""
    self_heating: float = 0.0
    """mA^2 at the cold film's resistance."""
    self_heating_known: float = 0.0
    lag_s: float = 0.0
    """Of the relays behind the temperature."""
    sharpness: float = 0.0
    """mA^4, of a capacity that grows with the square of the phase's change with temperature."""
    film_heat: float = 0.0
    """mA^2, as `latent`, but by the phase that the resistance shows."""
    cooling: float = 0.0
    """By what part cooling takes longer than heating."""
    zone: float = 0.0
    """mA of the current that does not heat: the identified loops go over all of it."""
    drift: float = 0.0
    """mA^2/s, of the room from a record's start: the film is warmer by so much than its heat makes it."""

    @property
    def is_plain(self) -> bool:
        """Whether the nominal solution, exact for held currents, is enough."""
        return self == Balance(self.time_constant_s, zone=self.zone, drift=self.drift)


class Warm(NamedTuple):
    """Temperature at the instants: every sample, and what lies between."""

    power: FloatArray
    """Surrogate (instants,) [mA^2]."""
    lagging: FloatArray
    """What the relays see (instants,) [mA^2]."""
    peaks: FloatArray
    """Where that turned since the instant before (instants,) [mA^2]; its own value where it did not."""
    time_s: FloatArray
    """(instants,) since the first sample."""


class Read(NamedTuple):
    """What film and beam give at the instants, and what instruments make of it; mechanisms replace it."""

    reading: FloatArray
    """-ln R of the film (instants,)."""
    deflection: FloatArray
    """(instants,) [um]"""
    resistance_relays: FloatArray
    """The part of `reading` that the switched relays make (instants,)."""
    deflection_relays: FloatArray
    resistance: FloatArray
    """What the sensor reads (instants,) [ohm]; once `film` contributions are done."""
    surrogate: FloatArray
    """v (instants,) [mA]"""
    current: FloatArray
    """That flows just before each instant (instants,) [mA]."""
    current_after: FloatArray
    """And just after it."""
    time_s: FloatArray
    steps_s: FloatArray
    """From one instant to the next, the pattern of one sample period."""
    span: Span
    """Of the current at identification [mA]."""
    temperature: FloatArray
    """Of the film (instants,), in mA^2 of a linear loss."""
    relays_temperature: FloatArray
    """And what the relays see of it."""
    phases: Phases
    """Of the film, all of whose changes with temperature are late where the relays are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Mechanism(Mechanism):
    """A mechanism with its contributions; all others are None."""

    command: Callable[[Commanded, Values], Commanded] | None = None
    pieces: Callable[[Pieces, Values], Pieces] | None = None
    balance: Callable[[Balance, Values], Balance] | None = None
    warm: Callable[[Warm, Values], Warm] | None = None
    loops: Callable[[FloatArray, FloatArray, Values], tuple[FloatArray, FloatArray]] | None = None
    """Changes what the identified loops see at the instants, and by way of which peaks (instants,) [mA]."""
    film: Callable[[Read, Values], Read] | None = None
    """Changes `reading` and `deflection`."""
    instrument: Callable[[Read, Values], Read] | None = None
    """Changes `resistance` and `deflection`."""
    resolves_s: Callable[[Values], float] | None = None
    """Needs readings between samples too, at most so many seconds apart."""
    stage: int = 0
    """Among mechanisms that act at the same place: lower ones first."""

    @property
    def acts_on_temperature(self) -> bool:
        """Whether lanes with different values cannot share one temperature."""
        return any(
            act is not None for act in (self.command, self.pieces, self.balance, self.warm, self.loops)
        )


def power_of(s: Scales) -> float:
    """mA^2 that heat is compared with: of a current in the middle of a transition."""
    return s.drive**2


def coefficient(
    name: str, unit: str, meaning: str, scale: float | Callable[[Scales], float], **more: Any
) -> Parameter:
    """A parameter that switches its mechanism off at zero; a number as `scale` is of all VO2 actuators."""
    of_records = scale if callable(scale) else lambda s: scale
    return Parameter(name=name, unit=unit, meaning=meaning, scale=of_records, neutral=0.0, **more)


def shape(
    name: str, unit: str, meaning: str, scale: float | Callable[[Scales], float], **more: Any
) -> Parameter:
    """A parameter that says how a mechanism acts."""
    of_records = scale if callable(scale) else lambda s: scale
    return Parameter(
        name=name, unit=unit, meaning=meaning, scale=of_records, neutral=None, **{"low": 1e-9, **more}
    )  # fmt: skip


def known(**more: Any) -> Parameter:
    """The share of a steady effect that the identified loops hold already."""
    return shape(
        "known", "dimensionless", "share of its steady effect that the identified loops hold already", 1.0,
        default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0), **more,
    )  # fmt: skip


ACTIVATION = shape(
    "activation", "1/mA^2", "by which the semiconductor, not switched, conducts better with temperature",
    lambda s: 1.0 / power_of(s), default=0.0, low=0.0, shape_range=(0.0, 10.0),
)  # fmt: skip
EXPANSION = shape(
    "expansion", "um/mA^2", "by which the beam, not switched, bends back with temperature",
    lambda s: s.excursion / power_of(s), default=0.0, low=-math.inf, shape_range=(-10.0, 10.0),
)  # fmt: skip
MIXING = shape(
    "mixing", "dimensionless", "exponent of the film's mixture, 0 a logarithmic one", 1.0, default=0.0, low=-1.0,
    high=1.0, shape_range=(-1.0, 1.0),
)  # fmt: skip
PURE_PHASES = (ACTIVATION, EXPANSION, MIXING)
"""Shapes of a mechanism by which the transition is late: see `rtctl.simulations.vo2.phases`."""
