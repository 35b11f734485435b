"""Each mechanism's equation, written out a second time for SciPy: the tests' own transcription of the sentence.

y = (z, v, own states); u the drive on a piece between its breakpoints; p the mechanism's parameters. What is not in
an entry is as in the nominal oscillator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from duffing_cases import (
    PERIOD_S,
    V_0,
    Z_0,
    FloatArray,
    duffing,
    held,
    solved,
    stick_slip,
)

P = Mapping[str, float]
EXACT = 1e-7
"""Of the peak: RK4's phase is off by (w h)^4 / 120 = 3e-9 a radian at 256 steps a period, so by 1e-7 in the 31 radians
of a record; at the fastest pole, that is, which the motion seldom has.

Where a force has a kink within a step of h (here 1/11,500 s), the impulse is off by up to h^2 / 24 of its change of
slope: that is where the larger tolerances below come from. In parts of the peak, 0.16 mm at 200 rad/s:
dead band: 6e4 mm/s^3 at each of 20 edges, 1e-6 each.
Bouc-Wen: 4e4 1/s^2 of h' at each of 15 turning points, 250 mm/s^2 of force, 1e-6 each.
delay: 6e3 mm/s^3 at each of 300 samples, 1e-7 each; a held drive is put into the step's mean, so it pushes up to h/2
early or late: 60 mm/s^2 h^2 / 8, 3e-7 each.
friction: its turning points lie on a parabola, (w h)^3 / 6 = 2e-6 each.
clearance, stops: 3e4 1/s^2 at each of 60 crossings at 10 mm/s; a stiff stop has half of the step, 7e-7 each.
backlash: as the dead band, 6e4 mm/s^3 at each of 25 reversals; hysteresis less, and 200 plays in place of all.
sensor lag: a cubic through samples 1/900 s apart, (w / 900 s)^4 / 384 = 6e-6."""


@dataclass(frozen=True, kw_only=True)
class Oracle:
    """One mechanism away from neutral."""

    values: Mapping[str, float]
    rate: Callable[[float, FloatArray, float, P], list[float]] = lambda t, y, u, p: [
        y[1],
        duffing(y[0], y[1], u),
    ]
    states: Callable[[float], list[float]] = lambda first: []
    """Its own states at the start; `first` sample of the drive."""
    reading: Callable[[FloatArray, FloatArray, P], FloatArray] = lambda t, y, p: y[:, 0]
    """Displacement (samples,) that is read, from times and states (samples, n)."""
    speed: Callable[[FloatArray], FloatArray] = lambda y: y[:, 1]
    """Velocity (samples,) that is read."""
    beside: Callable[[FloatArray, str, P], FloatArray] = lambda samples, hold, p: 0.0 * samples
    """What is read (samples,) beside the motion, from the drive's samples and their hold."""
    delay_s: Callable[[P], float] = lambda p: 0.0
    """By how much the drive is late [s]."""
    blend: Mapping[str, str] = field(default_factory=dict)
    """Parameter -> the hold towards which it moves the drive."""
    played: str = ""
    """Parameter of the play operators through which the drive acts: half of the play, or the density of many."""
    tolerance: float = EXACT
    """Of the peak displacement."""
    drive_side: bool = False


def leaked(samples: FloatArray, hold: str, p: P) -> FloatArray:
    """Drive and its change in the reading, partly before it steps."""
    if hold == "zero":
        before = np.append(samples[:1], samples[:-1])
        after = np.append(samples[:-1], samples[-2])  # what follows the last row is not in the record
        return p["gain"] * (p["before"] * before + (1.0 - p["before"]) * after)
    slopes = np.diff(samples) / PERIOD_S
    before, after = np.append(slopes[:1], slopes), np.append(slopes, slopes[-1:])
    return p["gain"] * samples + p["rate"] * (p["before"] * before + (1.0 - p["before"]) * after)


def linear_mode(y: FloatArray, u: float, p: P) -> list[float]:
    """q' and q'' of the second mode, y[2] and y[3]."""
    w = 2.0 * math.pi * p["frequency"]
    return [y[3], p["gain"] * u - 2.0 * p["damping_ratio"] * w * y[3] - w * w * y[2]]


def pull(y: FloatArray, p: P) -> float:
    """Of a carried mass, at y[4] and y[5], on the device."""
    w = 2.0 * math.pi * p["frequency"]
    return float(2.0 * p["damping_ratio"] * w * (y[5] - y[1]) + w * w * (y[4] - y[0]))


def langevin(u: float, curvature: float) -> float:
    """3 L(x) / sqrt(curvature)."""
    x = math.sqrt(curvature) * u
    if abs(x) < 1e-2:
        return u * (1.0 - x * x / 15.0 + 2.0 * x**4 / 315.0)
    return 3.0 * (1.0 / math.tanh(x) - 1.0 / x) / math.sqrt(curvature)


def dead(u: float, width: float) -> float:
    """Nothing within the width, less by it beyond."""
    if abs(u) <= width:
        return 0.0
    return u - width if u > 0.0 else u + width


def beyond(z: float, low: float, high: float) -> float:
    """How far z is above high (positive) or below low (negative)."""
    if low <= z <= high:
        return 0.0
    return z - high if z > high else z - low


def played(samples: FloatArray, hold: str, width: float) -> Callable[[float], Any]:
    """The drive behind a play, by its definition: where it stood at each sample, and from there along each piece."""
    at_sample, w = [], 0.0
    for u in samples:
        w = min(max(w, u - width), u + width)
        at_sample.append(w)

    def between(at: float) -> Any:
        own = held(samples, hold, at)
        k = min(max(math.floor(at / PERIOD_S), 0), len(samples) - 1)
        return lambda t: min(max(at_sample[k], own(t) - width), own(t) + width)

    return between


def played_by_many(samples: FloatArray, hold: str, p: P) -> Callable[[float], Any]:
    """The drive and many plays behind it, of thresholds up to its largest size."""
    size = float(np.abs(samples).max())
    widths = (np.arange(200) + 0.5) / 200 * size
    weights = p["density"] * np.exp(-p["fading"] * widths) * size / 200
    at_sample, w = [], np.zeros(200)
    for u in samples:
        w = np.clip(w, u - widths, u + widths)
        at_sample.append(w)

    def between(at: float) -> Any:
        own = held(samples, hold, at)
        k = min(max(math.floor(at / PERIOD_S), 0), len(samples) - 1)
        return lambda t: own(t) + weights @ np.clip(at_sample[k], own(t) - widths, own(t) + widths)

    return between


def cut(z: FloatArray, p: P) -> FloatArray:
    """What is beyond the limit, less a share."""
    beyond = np.maximum(np.abs(z) - p["limit"], 0.0)
    return z - np.sign(z) * p["clipped"] * beyond


def warming(t: Any, p: dict[str, float]) -> Any:
    """A drift at t over its first rate, of a device that warms up."""
    return p["settling_time"] * (1.0 - np.exp(-t / p["settling_time"]))


def nearest(z: FloatArray, p: P) -> FloatArray:
    """Of all levels the nearest to each z."""
    reach = math.ceil(np.abs(z).max() / p["step"]) + 1
    levels = p["level"] + p["step"] * np.arange(-reach, reach + 1)
    return np.asarray(levels[np.abs(z[:, None] - levels).argmin(axis=1)])


def bouc_wen(y: FloatArray, p: P) -> float:
    """h' of y[2]."""
    z_rate, h = y[1], y[2]
    size = abs(h) ** p["order"]
    return (z_rate - p["loop"] * abs(z_rate) * math.copysign(size, h) - p["bend"] * z_rate * size) / p[
        "displacement"
    ]


def stribeck(v: float, p: P) -> float:
    """Size of the friction at the velocity `v`, once it slides."""
    return p["level"] + p["excess"] * math.exp(-((v / p["transition_speed"]) ** 2))


def dahl(y: FloatArray, p: P) -> float:
    """F' of the friction y[2]."""
    stiffness = p["level"] / p["displacement"]
    return float(stiffness * y[1] * (1.0 - y[2] / p["level"] * np.sign(y[1])))


def clipped(u: float, p: P) -> float:
    return u - p["clipped"] * (u - min(max(u, -p["limit"]), p["limit"]))


ORACLES: dict[str, Oracle] = {
    "stiffness.quadratic": Oracle(
        values={"coefficient": 3.0e4},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * y[0] * y[0]],
    ),
    "stiffness.cubic": Oracle(
        values={"coefficient": -2.5e5},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * y[0] ** 3],
    ),
    "stiffness.quintic": Oracle(
        values={"coefficient": 3.0e7},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * y[0] ** 5],
    ),
    "stiffness.parametric": Oracle(
        values={"coefficient": 900.0},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * u * y[0]],
    ),
    "stiffness.drift": Oracle(
        values={"rate": -9000.0, "settling_time": 0.3},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["rate"] * warming(t, p) * y[0]],
    ),
    "stiffness.viscoelastic": Oracle(
        values={"stiffness": 3000.0, "time_constant": 0.013},
        rate=lambda t, y, u, p: [
            y[1], duffing(y[0], y[1], u) - p["stiffness"] * y[2], y[1] - y[2] / p["time_constant"],
        ],
        states=lambda first: [0.0],
    ),
    "damping.nonlinear": Oracle(
        values={"coefficient": 700.0},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * y[0] * y[0] * y[1]],
    ),
    "damping.quadratic": Oracle(
        values={"coefficient": 1.5},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * abs(y[1]) * y[1]],
    ),
    "damping.asymmetric": Oracle(
        values={"coefficient": 6.0},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["coefficient"] * abs(y[1])],
        tolerance=1e-6,  # a step crosses the kink
    ),
    "friction.coulomb": Oracle(values={"level": 350.0, "transition_speed": 0.0}, tolerance=2e-5),
    "hysteresis.bouc_wen": Oracle(
        values={"level": 250.0, "displacement": 0.03, "loop": 0.6, "bend": 0.3, "order": 1.7},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - p["level"] * y[2], bouc_wen(y, p)],
        states=lambda first: [0.0],
        tolerance=2e-5,
    ),
    "mode.second": Oracle(
        values={"gain": 500.0, "mass_ratio": 0.15, "frequency": 41.0, "damping_ratio": 0.03},
        rate=lambda t, y, u, p: [
            y[1], duffing(y[0], y[1], u) + p["mass_ratio"] * pull(y, p), *linear_mode(y, u, p), y[5], -pull(y, p),
        ],
        states=lambda first: [0.0, 0.0, Z_0, V_0],
        reading=lambda t, y, p: y[:, 0] + y[:, 2],
        speed=lambda y: y[:, 1] + y[:, 3],
    ),
    "drive.harmonics": Oracle(
        values={"second": 0.11, "third": -0.04},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u + p["second"] * u**2 + p["third"] * u**3)],
        drive_side=True,
    ),
    "drive.saturation": Oracle(
        values={"curvature": 0.9, "clipped": 0.7, "limit": 0.8},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], clipped(langevin(u, p["curvature"]), p))],
        tolerance=2e-5,
        drive_side=True,
    ),
    "drive.deadband": Oracle(
        values={"width": 0.7},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], dead(u, p["width"]))],
        tolerance=2e-5,
        drive_side=True,
    ),
    "drive.delay": Oracle(
        values={"delay": 3.3 * PERIOD_S}, delay_s=lambda p: p["delay"], tolerance=1e-4, drive_side=True
    ),
    "drive.lag": Oracle(
        values={"time_constant": 0.006, "settled": 0.4},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], y[2]), (u - y[2]) / p["time_constant"]],
        states=lambda first: [0.4 * first],
        drive_side=True,
    ),
    "drive.offset": Oracle(
        values={"offset": -0.8},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u + p["offset"])],
        drive_side=True,
    ),
    "sensor.saturation": Oracle(
        values={"curvature": 40.0, "clipped": 0.7, "limit": 0.05},
        reading=lambda t, y, p: cut(np.tanh(math.sqrt(p["curvature"]) * y[:, 0]) / math.sqrt(p["curvature"]), p),
    ),
    "sensor.offset": Oracle(values={"offset": 0.013}, reading=lambda t, y, p: y[:, 0] + p["offset"]),
    "sensor.lag": Oracle(
        values={"time_constant": 0.004},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u), (y[0] - y[2]) / p["time_constant"]],
        states=lambda first: [Z_0],
        reading=lambda t, y, p: y[:, 2],
        tolerance=1e-5,
    ),
    "sensor.hum": Oracle(
        values={"cosine": 0.011, "sine": -0.02, "frequency": 50.0},
        reading=lambda t, y, p: (
            y[:, 0]
            + p["cosine"] * np.cos(2 * np.pi * p["frequency"] * t)
            + p["sine"] * np.sin(2 * np.pi * p["frequency"] * t)
        ),
    ),
    "input.hold": Oracle(
        values={"toward_zero": 0.4, "toward_linear": 0.3, "toward_band_limited": 0.0},
        blend={"toward_zero": "zero", "toward_linear": "linear"},
        drive_side=True,
    ),
    "friction.stribeck": Oracle(
        values={"level": 250.0, "excess": 150.0, "transition_speed": 4.0}, tolerance=2e-5
    ),
    "friction.presliding": Oracle(
        values={"level": 250.0, "displacement": 0.02},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u) - y[2], dahl(y, p)],
        states=lambda first: [0.0],
        tolerance=2e-5,
    ),
    "damping.power": Oracle(
        values={"level": 400.0, "exponent": 1.6, "speed": 12.0},
        rate=lambda t, y, u, p: [
            y[1],
            duffing(y[0], y[1], u) - p["level"] * math.copysign(abs(y[1] / p["speed"]) ** p["exponent"], y[1]),
        ],
        tolerance=2e-6,
    ),
    "stiffness.clearance": Oracle(
        values={"gap": 0.03, "centre": 0.4},
        rate=lambda t, y, u, p: [
            y[1], duffing(beyond(y[0], -0.6 * p["gap"], 1.4 * p["gap"]), y[1], u),
        ],
        tolerance=2e-5,
    ),
    "stop.one_sided": Oracle(
        values={"above": 3.0e4, "below": 9.0e3, "place": 0.05, "retardation_time": 1.5e-3},
        rate=lambda t, y, u, p: [
            y[1],
            duffing(y[0], y[1], u)
            - p["above" if y[0] > p["place"] else "below"] * (y[0] - p["place"] + p["retardation_time"] * y[1]),
        ],
        tolerance=5e-5,
    ),
    "stop.two_sided": Oracle(
        values={"stiffness": 3.0e4, "lower": -0.04, "upper": 0.07, "retardation_time": 2.0e-3},
        rate=lambda t, y, u, p: [
            y[1],
            duffing(y[0], y[1], u)
            - p["stiffness"] * (
                beyond(y[0], p["lower"], p["upper"])
                + p["retardation_time"] * y[1] * (not p["lower"] < y[0] < p["upper"])
            ),
        ],
        tolerance=5e-5,
    ),
    "stiffness.gravity": Oracle(
        values={"coefficient": 7.0e3, "radian": 0.06},
        rate=lambda t, y, u, p: [
            y[1],
            duffing(y[0], y[1], u)
            + p["coefficient"] * y[0] - p["coefficient"] * p["radian"] * math.sin(y[0] / p["radian"]),
        ],
    ),
    "base.motion": Oracle(
        values={"cosine": 90.0, "sine": -140.0, "frequency": 8.3},
        rate=lambda t, y, u, p: [
            y[1],
            duffing(y[0], y[1], u)
            + p["cosine"] * math.cos(2 * math.pi * p["frequency"] * t)
            + p["sine"] * math.sin(2 * math.pi * p["frequency"] * t),
        ],
    ),
    "actuator.backlash": Oracle(
        values={"width": 0.7},
        played="width",
        tolerance=2e-5,
        drive_side=True,
    ),
    "actuator.hysteresis": Oracle(
        values={"density": 0.5, "remanence": 0.0, "fading": 0.3},
        played="density",
        tolerance=1e-4,
        drive_side=True,
    ),
    "timing.skew": Oracle(
        values={"late": 1.7 * PERIOD_S}, delay_s=lambda p: -p["late"], tolerance=1e-4, drive_side=True
    ),
    "sensor.highpass": Oracle(
        values={"rate": 60.0},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u), p["rate"] * (y[0] - y[2])],
        states=lambda first: [0.0],
        reading=lambda t, y, p: y[:, 0] - y[:, 2],
        tolerance=1e-5,
    ),
    "sensor.crosstalk": Oracle(values={"gain": 0.15, "rate": 3e-4, "before": 0.7}, beside=leaked, drive_side=True),
    "sensor.drift": Oracle(
        values={"rate": -0.3, "settling_time": 0.05}, reading=lambda t, y, p: y[:, 0] + p["rate"] * warming(t, p)
    ),
    "sensor.quantisation": Oracle(
        values={"step": 0.02, "level": 0.007}, reading=lambda t, y, p: nearest(y[:, 0], p)
    ),
    "input.gain_drift": Oracle(
        values={"rate": 1.6, "settling_time": 0.1},
        rate=lambda t, y, u, p: [y[1], duffing(y[0], y[1], u * (1.0 + p["rate"] * warming(t, p)))],
        drive_side=True,
    ),
}  # fmt: skip


def oracle_motion(identity: str, samples: FloatArray, hold: str) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity (samples,) with this mechanism at its oracle's values."""
    oracle, p = ORACLES[identity], ORACLES[identity].values
    t = PERIOD_S * np.arange(len(samples))
    if identity == "friction.coulomb":
        y = stick_slip(samples, hold, p["level"])
        return y[:, 0], y[:, 1]
    if identity == "friction.stribeck":
        y = stick_slip(samples, hold, stribeck(0.0, p), sliding=lambda v: stribeck(v, p))
        return y[:, 0], y[:, 1]

    def blended(at: float) -> Any:
        own = held(samples, hold, at)
        others = [(p[name], held(samples, other, at)) for name, other in oracle.blend.items()]
        return lambda t: own(t) + sum(weight * (other(t) - own(t)) for weight, other in others)

    behind = played_by_many(samples, hold, p) if oracle.played == "density" else None
    if oracle.played == "width":
        behind = played(samples, hold, p["width"])
    y = solved(
        lambda t, y, u: oracle.rate(t, y, u, p),
        samples,
        hold,
        [Z_0, V_0, *oracle.states(float(samples[0]))],
        delay=oracle.delay_s(p),
        drive=blended if oracle.blend else behind,
    )
    return oracle.reading(t, y, p) + oracle.beside(samples, hold, p), oracle.speed(y)
