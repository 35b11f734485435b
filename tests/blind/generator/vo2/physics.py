"""Numbers of the plant: what each field of `Physics` means; an effect is a field away from its neutral value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
CREEP_ELEMENTS = 3


class Physics(NamedTuple):
    """theta is the temperature over ambient [K], i the current [mA], phi the metallic fraction."""

    tau: float  # s, heating and cooling
    heating: float  # K/mA^2, c
    ambient: float  # deg C
    top: float  # K, theta at the largest current: static maps are normalised there
    top_current: float  # mA
    semiconductor: float  # ohm at 25 deg C
    activation: float  # K, Ea / k
    metal: float  # ohm
    mixing: float  # n of R^-n = (1 - phi) Rs^-n + phi Rm^-n; 0: logarithmic
    stroke: float  # um, of the transition
    expansion: float  # um/K, against it
    # effects, neutral at 0 unless said otherwise
    second_share: float = 0.0  # of the heating that goes through the slow path
    second_tau: float = 0.05  # s
    loss: float = 0.0  # conductance grows to (1 + loss) from theta = 0 to top
    latent: float = 0.0  # K, latent heat over heat capacity
    tcr: float = 0.0  # 1/K, of the heater
    delay: float = 0.0  # s
    deadband: float = 0.0  # mA
    resonance: float = 0.0  # Hz of the beam; 0: rigid
    quality: float = 20.0
    transition_tau: float = 0.0  # s, the transition's lag behind temperature
    creep: float = 0.0  # share of the fraction that creeps
    creep_tau: float = 0.05  # s, the fastest of three elements, each 3 times slower than the one before
    sense_heat: float = 0.0  # K at the resistance `semiconductor`
    sensor_tau: float = 0.0  # s, of the resistance reading
    crosstalk: float = 0.0  # ohm/mA
    widening: float = 0.0  # relative growth of all widths a full cycle of temperature
    film_power: float = 0.0  # growth of the heating as the film turns metallic (runaway)
    slow_cooling: float = 0.0  # cooling takes (1 + this) times as long
    hum: float = 0.0  # mA
    hum_hz: float = 50.0


class Grains(NamedTuple):
    """Relays of temperature: for each half-width a smooth density of centres; a Preisach model with memory."""

    half_width: FloatArray  # K
    weight: FloatArray  # sums to 1
    centre: FloatArray  # deg C
    spread: FloatArray  # K
    skew: float
