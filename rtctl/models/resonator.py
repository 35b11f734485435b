"""A resonator as the loop sees it, from an oscillator's model file and its mechanisms; lengths in um, drive in mA.

A delay, a lag of the drive and one of the sensor rotate and shrink the phasors around the resonance; forces against
the motion make the damping depend on the amplitude, a saturating sensor the reading; a nonlinear spring shifts the
frequency.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.arithmetic.elementary import cos, sin
from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, ModelFile
from rtctl.models.describing import equivalent_damping, saturated_amplitude, unsaturated_amplitude
from rtctl.models.harmonic_balance import backbone
from rtctl.models.oscillator import read_oscillator_model

BENDS = {"stiffness.cubic": "1/(um^2*s^2)", "stiffness.quintic": "1/(um^4*s^2)"}
"""Mechanisms in the backbone, each with the unit of its `coefficient`."""
PLACES = {
    "drive.delay": ("delay", "s", "delay_s"),
    "drive.lag": ("time_constant", "s", "drive_lag_s"),
    "sensor.lag": ("time_constant", "s", "sensor_lag_s"),
    "sensor.saturation": ("curvature", "1/um^2", "sensor_curvature"),
    "damping.nonlinear": ("coefficient", "1/(um^2*s)", "damping_squared"),
    "damping.quadratic": ("coefficient", "1/um", "damping_quadratic"),
    "friction.coulomb": ("level", "um/s^2", "friction"),
}
"""Mechanisms with a place in the loop: parameter, unit, field of `ResonatorModel`."""
UNMODELLED = {
    "sensor.saturation": ("clipped", "dimensionless"),
    "friction.coulomb": ("transition_speed", "um/s"),
}
"""Parameters of those mechanisms, with units, which have no place in the loop where they are not 0."""
INDIFFERENT = {
    "stiffness.quadratic": "its harmonics are even: no part of the first",
    "damping.asymmetric": "its harmonics are even: no part of the first",
    "drive.offset": "constant",
    "sensor.offset": "constant",
    "sensor.hum": "far from the resonance",
    "sensor.drift": "far from the resonance",
    "drive.harmonics": "far from the resonance",
    "input.hold": "the coil is driven by a sine",
}
"""Mechanisms without effect on amplitude and phase of the first harmonic, and why."""


class ResonatorParams(NamedTuple):
    """What the loop of a resonator knows of its model; names and units as in `ResonatorModel`."""

    damping: float
    damping_squared: float
    damping_quadratic: float
    friction: float
    resonance: float
    decay: float
    growth: float
    delay_s: float
    drive_lag_s: float
    sensor_lag_s: float


def decay_at(amplitude_um: float, p: Any) -> float:
    """Return sigma at an amplitude [1/s], half the slope of c(a) a; `p`: fields of `ResonatorParams`."""
    if p.damping_squared == 0.0 and p.damping_quadratic == 0.0:
        return float(p.decay)
    a = max(amplitude_um, 0.0)
    slope = p.damping + 0.75 * p.damping_squared * a * a
    slope += 16.0 / (3.0 * math.pi) * p.damping_quadratic * p.resonance * a
    return float(max(0.5 * slope, 0.0))


def holding_current(amplitude_um: float, p: Any) -> float:
    """Return the current [mA] that keeps an amplitude at phase resonance; `p`: fields of `ResonatorParams`."""
    if p.damping_squared == 0.0 and p.damping_quadratic == 0.0 and p.friction == 0.0:
        return float(p.decay * amplitude_um / p.growth)
    c = equivalent_damping(
        max(amplitude_um, 1e-12), p.resonance, p.damping, p.damping_squared, p.damping_quadratic, p.friction
    )
    return float(0.5 * c * amplitude_um / p.growth)


def straightened(x: float, y: float, frequency_hz: float, p: Any) -> tuple[float, float]:
    """Return the displacement's phasor against the force, from that of the reading against the current.

    Multiplied by (1 + i w l) / |1 + i w l| exp(i w d) (1 + i w s): drive's lag l, its delay d, sensor's lag s.

    Args:
        x: in phase with the current.
        y: in quadrature.
        frequency_hz: of the drive [Hz].
        p: fields of `ResonatorParams`.
    """
    if p.delay_s == 0.0 and p.drive_lag_s == 0.0 and p.sensor_lag_s == 0.0:
        return x, y
    rate = 2.0 * math.pi * frequency_hz
    drive, sensor = rate * p.drive_lag_s, rate * p.sensor_lag_s
    size = math.sqrt(1.0 + drive * drive)
    a, b = (1.0 - drive * sensor) / size, (drive + sensor) / size
    c, s = cos(rate * p.delay_s), sin(rate * p.delay_s)
    real, imaginary = a * c - b * s, a * s + b * c
    return x * real - y * imaginary, x * imaginary + y * real


@dataclass(frozen=True, slots=True, kw_only=True)
class ResonatorModel:
    """z'' + damping z' + stiffness z + cubic z^3 + quintic z^5 = drive_gain u; z [um], u the commanded current [mA]."""

    damping: float
    """Damping [1/s]."""
    stiffness: float
    """Linear stiffness [1/s^2]."""
    cubic: float
    """Cubic stiffness [1/(um^2 s^2)]."""
    quintic: float
    """Quintic stiffness [1/(um^4 s^2)]."""
    drive_gain: float
    """Drive gain [um/s^2/mA] near resonance (it includes the coil's loss)."""
    identity: str
    """Identity of the device on which it was identified; "" where the file has none."""
    delay_s: float = 0.0
    """Delay [s] of the force behind the commanded current."""
    drive_lag_s: float = 0.0
    sensor_lag_s: float = 0.0
    sensor_curvature: float = 0.0
    """Curvature of the sensor [1/um^2]."""
    damping_squared: float = 0.0
    """Coefficient of z^2 z' [1/(um^2 s)]."""
    damping_quadratic: float = 0.0
    """Coefficient of |z'| z' [1/um]."""
    friction: float = 0.0
    """Dry friction [um/s^2]."""
    used: tuple[str, ...] = ()
    """Mechanisms of the file with a place in the loop."""
    indifferent: tuple[str, ...] = ()
    """Mechanisms of the file that do not affect the loop."""
    not_considered: tuple[str, ...] = ()
    """Mechanisms of the file that affect the loop but are not modelled in it."""

    def __post_init__(self) -> None:
        for name in ("damping", "stiffness", "drive_gain"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be > 0 to control a resonator, got {getattr(self, name):g}")

    @property
    def resonance(self) -> float:
        """Linear resonance [rad/s]."""
        return math.sqrt(self.stiffness)

    @property
    def decay(self) -> float:
        """Rate sigma = omega0 / 2Q [1/s]: the pole of amplitude and phase."""
        return 0.5 * self.damping

    @property
    def params(self) -> ResonatorParams:
        """What the loop's functions take."""
        return ResonatorParams(*(float(getattr(self, name)) for name in ResonatorParams._fields))

    @property
    def growth(self) -> float:
        """Slope d amplitude / dt that a current gives at resonance [um/s/mA]."""
        shrunk = abs(self.drive_phasor(self.resonance / (2.0 * math.pi)))
        return shrunk * self.drive_gain / (2.0 * self.resonance)

    def drive_phasor(self, frequency_hz: float) -> complex:
        """Return force over commanded current, relative to `drive_gain`."""
        rate = 2.0 * math.pi * frequency_hz
        return cmath.exp(-1j * rate * self.delay_s) / (1.0 + 1j * rate * self.drive_lag_s)

    def sensor_phasor(self, frequency_hz: float) -> complex:
        """Return reading over displacement, where the sensor does not saturate."""
        return 1.0 / (1.0 + 2j * math.pi * frequency_hz * self.sensor_lag_s)

    def motion(self, reading: complex, frequency_hz: float) -> complex:
        """Return the displacement's phasor [um] against the force, from a lock-in's X + iY against the current."""
        size = abs(reading)
        if size > 0.0 and self.sensor_curvature > 0.0:
            reading *= unsaturated_amplitude(size, self.sensor_curvature) / size
        return complex(*straightened(reading.real, reading.imag, frequency_hz, self))

    def reads(self, amplitude_um: float) -> float:
        """Return the lock-in's reading of an amplitude at resonance [um]."""
        sensed = amplitude_um * abs(self.sensor_phasor(self.resonance / (2.0 * math.pi)))
        return saturated_amplitude(sensed, self.sensor_curvature)

    def decay_at(self, amplitude_um: float) -> float:
        """Return sigma at an amplitude [1/s]: half the slope of c(a) a."""
        return decay_at(amplitude_um, self)

    def holding_current(self, amplitude_um: float) -> float:
        """Return the current [mA] that keeps an amplitude at phase resonance."""
        return holding_current(amplitude_um, self)

    def backbone_hz(self, amplitude_um: float) -> float:
        """Return the frequency [Hz] of free vibration with this first harmonic, NaN where there is none."""
        found = backbone(amplitude_um, stiffness=self.stiffness, cubic=self.cubic, quintic=self.quintic)
        return found.frequency_hz if found.converged else math.nan


def read_resonator(path: Path) -> ResonatorModel:
    """Return the model in the file. Raises InputError naming file and key."""
    try:
        return resonator_of(read_oscillator_model(path))
    except ValueError as error:
        raise InputError(f"{path}: model.parameters: {error}") from None


def _is_set(mechanism: MechanismTable, parameter: tuple[str, str]) -> bool:
    name, unit = parameter
    return name in mechanism.parameters and mechanism.parameters[name].to(unit) > 0.0


def resonator_of(file: ModelFile) -> ResonatorModel:
    """Return the model of a model file's tables. Raises InputError, ValueError."""
    bends = dict.fromkeys(BENDS, 0.0)
    unknown = {
        one.id for one in file.model.mechanisms if one.id in UNMODELLED and _is_set(one, UNMODELLED[one.id])
    }
    known = (BENDS.keys() | PLACES) - unknown
    ids = [mechanism.id for mechanism in file.model.mechanisms]
    places: dict[str, float] = {}
    for mechanism in file.model.mechanisms:
        if mechanism.id in PLACES:
            parameter, unit, place = PLACES[mechanism.id]
            given = mechanism.parameters.get(parameter)
            places[place] = given.to(unit) if given else 0.0
    for mechanism in file.model.mechanisms:
        if mechanism.id in BENDS:
            coefficient = mechanism.parameters.get("coefficient")
            bends[mechanism.id] = coefficient.to(BENDS[mechanism.id]) if coefficient else 0.0
    return ResonatorModel(
        damping=file.value("damping", "1/s"),
        stiffness=file.value("stiffness", "1/s^2"),
        cubic=file.value("stiffness_cubic", BENDS["stiffness.cubic"]) + bends["stiffness.cubic"],
        quintic=bends["stiffness.quintic"],
        drive_gain=file.value("drive_gain", "um/s^2/mA"),
        identity=str(file.provenance.get("identity", "")),
        used=tuple(one for one in ids if one in known),
        indifferent=tuple(f"{one} ({INDIFFERENT[one]})" for one in ids if one in INDIFFERENT),
        not_considered=tuple(one for one in ids if one not in known and one not in INDIFFERENT),
        **places,
    )
