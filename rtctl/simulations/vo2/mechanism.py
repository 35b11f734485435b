"""Mechanisms of an identified VO2 actuator: effects on its current, its heat, its film or its readings.

A mechanism is one file: its declaration and one or more contributions, here in the order in which a signal passes
them. Temperatures are surrogates: v [mA] is the constant current that would hold them, v^2 [mA^2] its power.
The effect of a mechanism at rest is part of the identified loops already, where they come from the same device:
`known` is the share of it that they contain, all of it unless the data say otherwise.
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
"""Values of one mechanism, by parameter name."""
TYPICAL_TIME_S = NOMINAL_TIME_CONSTANT_S


class Commanded(NamedTuple):
    """The current as it was sampled [mA], and how it continues between samples."""

    samples: FloatArray
    """Samples (n,) [mA]."""
    period_s: float
    hold: str
    delay_s: float = 0.0
    onward: FloatArray = np.empty(0)
    """Samples (m,) [mA] after `samples`: a band-limited current before its last sample depends on them."""


class Pieces(NamedTuple):
    """The current over pieces of each sample period, smooth within each."""

    nodes: FloatArray
    """Current (periods * pieces, 3) at start, middle, end of each piece [mA]."""
    durations_s: FloatArray
    """Durations (pieces,) in one period [s]."""


class Balance(NamedTuple):
    """Constants of the heat balance; see `heat`. All but the time constant are 0 in the nominal model."""

    time_constant_s: float
    share: float = 0.0
    """Share of the second part [-]."""
    second_time_constant_s: float = 1.0
    tcr: float = 0.0
    """Temperature coefficient of the heater [1/mA^2]."""
    tcr_known: float = 0.0
    loss: float = 0.0
    """Nonlinear loss [1/mA^2]."""
    loss_known: float = 0.0
    latent: float = 0.0
    """Latent heat [mA^2]."""
    self_heating: float = 0.0
    """Heat of the sensing current [mA^2] at the cold film's resistance."""
    self_heating_known: float = 0.0
    lag_s: float = 0.0
    """Lag of the relays behind the temperature [s]."""
    sharpness: float = 0.0
    """Coefficient [mA^4] of a capacity that grows with the square of the phase's slope over temperature."""
    film_heat: float = 0.0
    """Latent heat [mA^2] that goes with the phase the resistance shows."""
    cooling: float = 0.0
    """Relative increase of the time constant while cooling [-]."""
    zone: float = 0.0
    """Current [mA] that does not heat; the identified loops refer to the whole current."""
    phase_heating: float = 0.0
    """Relative growth of the heating as the film turns metallic [-]."""
    phase_heating_known: float = 0.0
    drift: float = 0.0
    """Drift of the room [mA^2/s] at a record's start, by which the film is warmer than its heat makes it."""
    settling_s: float = 0.0
    """Time constant with which that drift settles [s]; 0: it does not."""

    @property
    def is_plain(self) -> bool:
        """Whether the nominal solution, exact for held currents, is enough."""
        return self == Balance(
            self.time_constant_s, zone=self.zone, drift=self.drift, settling_s=self.settling_s
        )


class Warm(NamedTuple):
    """Temperature at the instants: every sample, and points between."""

    power: FloatArray
    """Surrogate (instants,) [mA^2]."""
    lagging: FloatArray
    """Surrogate for the relays (instants,) [mA^2]."""
    peaks: FloatArray
    """Turning point of that since the instant before (instants,) [mA^2]; its own value without one."""
    time_s: FloatArray
    """Time (instants,) since the first sample [s]."""


class Read(NamedTuple):
    """Output of film and beam at the instants, and the instruments' readings of it; mechanisms replace them."""

    reading: FloatArray
    """Reading -ln R of the film (instants,)."""
    deflection: FloatArray
    """Deflection (instants,) [um]."""
    resistance_relays: FloatArray
    """Part of `reading` (instants,) from the switched relays."""
    deflection_relays: FloatArray
    resistance: FloatArray
    """Resistance that the sensor reads (instants,) [ohm]; set once `film` contributions are done."""
    surrogate: FloatArray
    """Surrogate v (instants,) [mA]."""
    current: FloatArray
    """Current just before each instant (instants,) [mA]."""
    current_after: FloatArray
    """Current just after each instant (instants,) [mA]."""
    time_s: FloatArray
    steps_s: FloatArray
    """Time from one instant to the next [s], the pattern of one sample period."""
    span: Span
    """Range of the current at identification [mA]."""
    temperature: FloatArray
    """Temperature of the film (instants,), in mA^2 of a linear loss."""
    relays_temperature: FloatArray
    """Temperature for the relays (instants,) [mA^2]."""
    phases: Phases
    """Phases of the film, all of whose changes with temperature lag where the relays do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Mechanism(Mechanism):
    """A mechanism with its contributions; all others are None."""

    command: Callable[[Commanded, Values], Commanded] | None = None
    pieces: Callable[[Pieces, Values], Pieces] | None = None
    balance: Callable[[Balance, Values], Balance] | None = None
    warm: Callable[[Warm, Values], Warm] | None = None
    loops: Callable[[FloatArray, FloatArray, Values], tuple[FloatArray, FloatArray]] | None = None
    """Changes the input of the identified loops at the instants, and its peaks (instants,) [mA]."""
    film: Callable[[Read, Values], Read] | None = None
    """Changes `reading` and `deflection`."""
    instrument: Callable[[Read, Values], Read] | None = None
    """Changes `resistance` and `deflection`."""
    reads_at: Callable[[Values], tuple[float, float]] | None = None
    """Return by how much [s] resistance and deflection are read after their rows' instants."""
    resolves: float | None = None
    """Longest interval between readings that it needs, between samples too, over the heating's time constant; None for
    no such need."""
    stage: int = 0
    """Order among mechanisms that act at the same place: lower ones first."""

    @property
    def acts_on_temperature(self) -> bool:
        """Whether lanes with different values cannot share one temperature."""
        return any(
            act is not None
            for act in (self.command, self.pieces, self.balance, self.warm, self.loops, self.reads_at)
        )


def heating_times(count: float) -> Callable[[Scales], float]:
    """Return a scale of so many time constants of the heating [s]."""
    return lambda s: count * (s.response_s or TYPICAL_TIME_S)


def power_of(s: Scales) -> float:
    """Return the scale of heat [mA^2]: the power of a current in the middle of a transition."""
    return s.drive**2


def coefficient(
    name: str, unit: str, meaning: str, scale: float | Callable[[Scales], float], **more: Any
) -> Parameter:
    """Declare a parameter that switches its mechanism off at zero; a number as `scale` holds for all VO2 actuators."""
    of_records = scale if callable(scale) else lambda s: scale
    return Parameter(name=name, unit=unit, meaning=meaning, scale=of_records, neutral=0.0, **more)


def shape(
    name: str, unit: str, meaning: str, scale: float | Callable[[Scales], float], **more: Any
) -> Parameter:
    """Declare a parameter of a mechanism's form."""
    of_records = scale if callable(scale) else lambda s: scale
    return Parameter(
        name=name, unit=unit, meaning=meaning, scale=of_records, neutral=None, **{"low": 1e-9, **more}
    )  # fmt: skip


def known(**more: Any) -> Parameter:
    """Declare the share of a steady effect that the identified loops contain already."""
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
"""Shapes of a mechanism that delays the transition: see `rtctl.simulations.vo2.phases`."""
