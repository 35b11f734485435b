"""A resonator with its amplifier and its displacement sensor; every hidden effect is one line of a table here.

The drive passes hold, delay, then the lines of `DRIVE`; the equation of motion takes the lines of `MOTION`; the reading
passes those of `READING`. At size zero each of them vanishes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import ceil
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from foreign_oscillator_motion import (
    LAGGED_DRIVE,
    LAGGED_READING,
    MODE,
    RELAXING,
    STATES,
    Law,
    V,
    Z,
    run,
)
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.signal import resample

ANGLE = 0.06  # largest angle [rad] that the fastest part of the equation turns in one step
LEAST_STEPS = 4  # of a sample period
MARGIN = 40  # samples of silence on both sides of a record whose drive is band-limited
LONGEST_LEAD = 20_000  # samples of a base that moves before the record begins
HOLDS = ("zero", "linear", "band-limited")

KNOWN = {
    "stiffness.quadratic": "+ s z^2 in the restoring force",
    "stiffness.cubic": "+ s z^3 in the restoring force",
    "stiffness.quintic": "+ s z^5 in the restoring force",
    "stiffness.parametric": "+ s u z in the restoring force",
    "stiffness.drift": "the stiffness changes by s over a record, linearly, or as a warm-up that settles",
    "stiffness.viscoelastic": "+ s (z - w), tau w' = z - w",
    "damping.nonlinear": "+ s z^2 z'",
    "damping.quadratic": "+ s |z'| z'",
    "friction.coulomb": "s sign(z'), and the mass sticks",
    "hysteresis.bouc_wen": "+ s h, D h' = z' (1 - (b sign(z' h) + 1 - b) |h|^n)",
    "mode.second": "'beside': a second mode, driven by s u, adds to the reading; 'carried': a mass s on a spring",
    "drive.harmonics": "u + s (a u^2 / U + b u^3 / U^2), U the largest drive",
    "drive.saturation": "3 v L(u / v), L(x) = coth x - 1 / x, v = U / s",
    "drive.deadband": "the first s of the drive does nothing",
    "drive.delay": "the drive acts s late",
    "drive.lag": "s l' = u - l, l acts",
    "drive.offset": "u + s at all times, also before the record",
    "sensor.saturation": "'soft': (A / s) tanh(s z / A); 'hard': cut at A (1 - s), A the largest motion",
    "sensor.offset": "reading + s",
    "sensor.lag": "s r' = z - r, r is read",
    "sensor.hum": "reading + s sin(2 pi f t + phase of the record), f that of the mains",
    "input.hold": "between its samples the drive is held in another way than the manifest says",
}
NEW = {
    "friction.coulomb:smooth": "s tanh(z' / v)",
    "friction.stribeck": "(s + (b - 1) s exp(-(z' / v)^2)) sign(z'), and the mass sticks up to b s",
    "friction.presliding": "+ s h, D h' = z' (1 - sign(z') h): Dahl",
    "stiffness.clearance": "the spring begins at |z| = s",
    "stop.one_sided": "another spring beyond z = A (1 - s), A the largest motion",
    "stop.two_sided": "another spring beyond |z| = A (1 - s)",
    "stiffness.gravity": "s of the stiffness is a weight's: s sin(z), z in rad",
    "damping.power": "+ s |z'|^n sign(z')",
    "base.motion": "the base accelerates with s times one sine, two, or forty close ones, always",
    "actuator.backlash": "the drive acts through a play of half-width s",
    "timing.skew": "the displacement is read s later (or earlier) than its row says",
    "sensor.highpass": "reading z - m, m' = 2 pi s (z - m): AC coupling with corner s",
    "sensor.drift": "reading + s (t / T)^p in each record of length T",
    "sensor.quantisation": "the reading is rounded to multiples of s",
    "input.gain_drift": "the drive acts 1 + s t / T times, or with a warm-up that settles",
}
EFFECTS = KNOWN | NEW


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One hidden effect: its name (an id, and a form behind a colon), size, unit, and the numbers beside it."""

    name: str
    size: float
    unit: str
    values: dict[str, float] = field(default_factory=dict)

    @property
    def id(self) -> str:
        """The id that a diagnosis should name."""
        return self.name.split(":")[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """What a lab would have to know about its oscillator and its converters."""

    law: Law
    period_s: float
    hold: str  # of the drive between its samples
    rest: float = 0.0  # displacement without any drive, about: the well of a bistable beam
    read_at_end: bool = (
        False  # a row's reading: at the start or the end of the period in which its drive acts
    )
    restart_periods: float = 0.0  # of the comparison between models; 0: free runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Drive samples of one record; those `before` were sent too, but the file begins behind them."""

    name: str
    use: str  # "fit", "test", or "" where the manifest does not say
    drive: Array
    before: Array = field(default_factory=lambda: np.empty(0))
    seed: int = 0  # of what differs from record to record without being noise
    repeat: str = ""


class Readings(NamedTuple):
    """Of each row, before noise: displacement and velocity; (z, z') at the edges of all steps from the first row."""

    displacement: Array
    velocity: Array
    fine: Array


Change = Callable[[Law, float, dict[str, float]], Law]
MOTION: dict[str, Change] = {
    "stiffness.quadratic": lambda law, s, x: law._replace(quadratic=s * x["sign"]),
    "stiffness.cubic": lambda law, s, x: law._replace(cubic=law.cubic + s * x["sign"]),
    "stiffness.quintic": lambda law, s, x: law._replace(quintic=s * x["sign"]),
    "stiffness.parametric": lambda law, s, x: law._replace(parametric=s * x["sign"]),
    "stiffness.drift": lambda law, s, x: law._replace(
        stiffness_drift=s * x["sign"], drift_s=x["over_s"], drift_settles=x["settles"]
    ),
    "stiffness.viscoelastic": lambda law, s, x: law._replace(relaxing=s, relaxing_s=x["tau_s"]),
    "damping.nonlinear": lambda law, s, x: law._replace(damping_z2=s),
    "damping.quadratic": lambda law, s, x: law._replace(damping_v2=s),
    "friction.coulomb": lambda law, s, x: law._replace(sliding=s),
    "friction.coulomb:smooth": lambda law, s, x: law._replace(sliding=s, smooth_speed=x["speed"]),
    "friction.stribeck": lambda law, s, x: law._replace(
        sliding=s, breakaway=s * (x["breakaway"] - 1.0), stribeck_speed=x["speed"]
    ),
    "friction.presliding": lambda law, s, x: law._replace(hysteretic=s, yielding=x["yielding"]),
    "hysteresis.bouc_wen": lambda law, s, x: law._replace(
        hysteretic=s, yielding=x["yielding"], loop=x["loop"], order=x["order"]
    ),
    "mode.second": lambda law, s, x: law._replace(
        mode_gain=0.0 if x["carried"] else s * law.gain,
        mode_mass=s if x["carried"] else 0.0,
        mode_rad_s=2.0 * np.pi * x["frequency_Hz"],
        mode_ratio=x["ratio"],
    ),
    "stiffness.clearance": lambda law, s, x: law._replace(clearance=s),
    "stop.one_sided": lambda law, s, x: _stopped(law, s, x, 1.0),
    "stop.two_sided": lambda law, s, x: _stopped(law, s, x, 2.0),
    "stiffness.gravity": lambda law, s, x: law._replace(gravity=s),
    "damping.power": lambda law, s, x: law._replace(power=s, exponent=x["exponent"]),
    "drive.lag": lambda law, s, x: law._replace(drive_lag_s=s),
    "sensor.lag": lambda law, s, x: law._replace(reading_lag_s=s),
    "sensor.highpass": lambda law, s, x: law._replace(reading_lag_s=1.0 / (2.0 * np.pi * s)) if s else law,
}
# u, t [s] -> u; in the order start, middle, end of each step
DRIVE: dict[str, Callable[[Array, Array, float, dict[str, float]], Array]] = {
    "drive.deadband": lambda u, t, s, x: np.sign(u) * np.maximum(np.abs(u) - s, 0.0),
    "drive.harmonics": lambda u, t, s, x: u + s * (x["a"] * u**2 / x["U"] + x["b"] * u**3 / x["U"] ** 2),
    "drive.saturation": lambda u, t, s, x: _langevin(u, x["U"] / s) if s else u,
    "drive.offset": lambda u, t, s, x: u + s * x["sign"],
    "actuator.backlash": lambda u, t, s, x: _play(u, s),
    "input.gain_drift": lambda u, t, s, x: u * (1.0 + s * x["sign"] * _ramp(t, x["over_s"], x["settles"])),
}
# reading, t [s], seed of the record -> reading
READING: dict[str, Callable[[Array, Array, int, float, dict[str, float]], Array]] = {
    "sensor.saturation": lambda y, t, k, s, x: _saturated(y, s, x),
    "sensor.offset": lambda y, t, k, s, x: y + s * x["sign"],
    "sensor.drift": lambda y, t, k, s, x: y + s * x["sign"] * (t / t[-1]) ** x["exponent"],
    "sensor.hum": lambda y, t, k, s, x: y + s * np.sin(2.0 * np.pi * (x["frequency_Hz"] * t + _turns(k))),
    "sensor.quantisation": lambda y, t, k, s, x: s * np.round(y / s) if s else y,
}


def _stopped(law: Law, s: float, x: dict[str, float], sides: float) -> Law:
    if s == 0.0:
        return law
    gap = x["A"] * (1.0 - s)
    return law._replace(
        stop_gap=gap, stop_stiffness=x["stiffness"], stop_damping=x["damping"], stop_sides=sides
    )


def _langevin(u: Array, knee: float) -> Array:
    x = np.where(np.abs(u / knee) < 1e-3, 1.0, u / knee)
    bent = 3.0 * knee * (1.0 / np.tanh(x) - 1.0 / x)
    return np.where(np.abs(u / knee) < 1e-3, u, bent)


def _play(u: Array, half_width: float) -> Array:
    behind, held = np.empty_like(u), 0.0
    for k, value in enumerate(u.tolist()):
        held = min(max(held, value - half_width), value + half_width)
        behind[k] = held
    return behind


def _ramp(t: Array, over_s: float, settles: float) -> Array:
    since = np.maximum(t, 0.0)
    return 1.0 - np.exp(-since / over_s) if settles else since / over_s


def _saturated(y: Array, s: float, x: dict[str, float]) -> Array:
    if s == 0.0:
        return y
    if x["hard"]:
        return np.clip(y, -x["A"] * (1.0 - s), x["A"] * (1.0 - s))
    return x["A"] / s * np.tanh(s * y / x["A"])


def _turns(seed: int) -> float:
    return float(np.random.default_rng([seed, 50]).random())


def steps_of(device: Device, law: Law) -> int:
    """Integration steps in a sample period: the fastest part of the equation turns by `ANGLE` at most."""
    squares = [abs(law.stiffness) + abs(law.relaxing) + law.stop_stiffness, law.mode_rad_s**2]
    squares.append(law.hysteretic / law.yielding if law.hysteretic else 0.0)
    fastest = max(np.sqrt(sum(squares)), law.sliding / law.smooth_speed if law.smooth_speed else 0.0)
    return max(ceil(device.period_s * fastest / ANGLE), LEAST_STEPS)


def acting_drive(samples: Array, hold: str, steps: int) -> Array:
    """Drive at start, middle and end of each of `steps` steps in every sample period: (samples * steps, 3)."""
    if hold == "zero":
        return np.repeat(np.repeat(samples, steps)[:, None], 3, axis=1)
    if hold == "linear":
        places = np.arange(2 * steps * samples.size + 1) / (2 * steps)
        nodes = np.interp(places, np.arange(samples.size), samples)
    else:
        padded = np.pad(samples, MARGIN)
        fine = resample(padded, padded.size * 2 * steps)
        nodes = fine[2 * steps * MARGIN :][: 2 * steps * samples.size + 1]
    return np.column_stack([nodes[0:-1:2], nodes[1::2], nodes[2::2]])


def rest_position(law: Law, push: float, about: float) -> float:
    """Displacement where the static forces balance `push` (of unit mass), the nearest to `about`."""

    def left(z: float) -> float:
        spring = z * (law.stiffness + z * (law.quadratic + z * (law.cubic + law.quintic * z * z)))
        return spring + law.gravity * (np.sin(z) - z) - push

    slope = abs(law.stiffness) * (2.0 if law.stiffness < 0.0 else 1.0)
    width = 1e-9 * (abs(about) + 1.0)
    for _ in range(60):
        if left(about - width) < 0.0 < left(about + width):
            return float(brentq(left, about - width, about + width, xtol=1e-14, rtol=1e-12))
        width = max(width * 1.5, 0.1 * abs(push) / slope if push else 0.0)
    return about


def changed_law(law: Law, effects: tuple[Effect, ...]) -> Law:
    """The equation of motion with all effects that act in it."""
    for effect in effects:
        if effect.name in MOTION:
            law = MOTION[effect.name](law, effect.size, effect.values)
    return law


def simulate(
    device: Device,
    record: Record,
    effects: tuple[Effect, ...] = (),
    steps: int | None = None,
    restarts: Array | None = None,
) -> Readings:
    """Readings of one record; NaN where the motion diverges.

    `steps`: integration steps in a sample period, if not as many as these effects need. `restarts`: `fine` of another
    simulation with as many steps, in whose first displacement and velocity the motion begins, and in a later one again
    every `restart_periods`.
    """
    law, found = changed_law(device.law, effects), {effect.name: effect for effect in effects}
    steps = steps or steps_of(device, law)
    h, skew = device.period_s / steps, found.get("timing.skew")
    late = skew.size * skew.values["sign"] if skew else 0.0
    before = np.empty(0) if restarts is not None else record.before
    if "base.motion" in found:  # which did not begin with the record
        before = np.concatenate([np.zeros(_decay_samples(device)), before])
    record = replace(record, before=before)
    drive, times = _drive(device, record, effects, steps, 2 + max(ceil(late / device.period_s), 0))
    base = base_acceleration(found.get("base.motion"), times, record.seed)
    start, every, anew = _start(law, device, found), 0, np.zeros((1, 2))
    if restarts is not None:
        start[[Z, V]], anew = restarts[0], restarts
        natural_s = 2.0 * np.pi / np.sqrt(natural_square(device.law))
        every = round(device.restart_periods * natural_s / h)
    states = run(law, drive, base, h, float(times[0, 0]), start, every, anew)
    first = steps * record.before.size
    rows = first + steps * (int(device.read_at_end) + np.arange(record.drive.size))
    reading = _seen(states, law, found)
    if late and np.isfinite(reading).all():
        reading = CubicSpline(np.arange(reading.size), reading)(
            np.clip(rows + late / h, 0.0, reading.size - 1.0)
        )
    else:
        reading = reading[rows]
    at_rows = device.period_s * np.arange(record.drive.size)
    for effect in effects:
        if effect.name in READING:
            reading = READING[effect.name](reading, at_rows, record.seed, effect.size, effect.values)
    return Readings(reading, states[rows, 1], states[first:, :2])


def _seen(states: Array, law: Law, found: dict[str, Effect]) -> Array:
    """What reaches the sensor's electronics at the edges of all steps, behind its lag or its AC coupling."""
    seen = states[:, 0] + (states[:, 2] if law.mode_gain else 0.0)
    if "sensor.lag" in found and law.reading_lag_s:
        return states[:, 3]
    return seen - states[:, 3] if "sensor.highpass" in found and law.reading_lag_s else seen


def _decay_samples(device: Device) -> int:
    """Samples in which a free motion dies away to 4 %."""
    return min(round(2.0 * np.pi / device.law.damping / device.period_s), LONGEST_LEAD)


def _drive(
    device: Device, record: Record, effects: tuple[Effect, ...], steps: int, after: int
) -> tuple[Array, Array]:
    """What acts of the drive, and the times [s] from the file's first row, both (steps, 3)."""
    found = {effect.name: effect for effect in effects}
    hold = device.hold
    if "input.hold" in found and found["input.hold"].size > 0.0:
        hold = HOLDS[int(found["input.hold"].values["hold"])]
    samples = np.concatenate([record.before, record.drive, np.full(after, record.drive[-1])])
    drive, h = acting_drive(samples, hold, steps), device.period_s / steps
    delay = round(found["drive.delay"].size / h) if "drive.delay" in found else 0
    drive = np.concatenate([np.zeros((delay, 3)), drive])[: drive.shape[0]]
    times = h * (np.arange(drive.shape[0])[:, None] + np.array([0.0, 0.5, 1.0]))
    times -= record.before.size * device.period_s
    for effect in effects:
        if effect.name in DRIVE:
            acting = DRIVE[effect.name](drive.ravel(), times.ravel(), effect.size, effect.values)
            drive = acting.reshape(-1, 3)
    return drive, times


def _start(law: Law, device: Device, found: dict[str, Effect]) -> Array:
    """States at rest, under the offset of the drive if it has one."""
    offset = found.get("drive.offset")
    constant = offset.size * offset.values["sign"] if offset else 0.0
    start = np.zeros(STATES)
    start[Z] = rest_position(law, law.gain * constant, device.rest)
    start[RELAXING] = start[LAGGED_READING] = start[Z]
    start[LAGGED_DRIVE] = constant
    start[MODE] = start[Z] if law.mode_mass else law.mode_gain * constant / max(law.mode_rad_s, 1e-9) ** 2
    return start


def natural_square(law: Law) -> float:
    """Square of the natural angular frequency [1/s^2], in the well if there are two."""
    return law.stiffness if law.stiffness > 0.0 else -2.0 * law.stiffness


def base_acceleration(effect: Effect | None, times: Array, seed: int) -> Array:
    """Acceleration of the base at `times`, with a phase of each record's own."""
    if effect is None or effect.size == 0.0:
        return np.zeros_like(times)
    rng, x = np.random.default_rng([seed, 60]), effect.values
    lines = int(x["lines"])
    spread = np.linspace(-1.0, 1.0, lines) if lines > 1 else np.zeros(1)
    total = np.zeros_like(times)
    for place, turns in zip(spread, rng.random(lines), strict=True):
        total += np.sin(2.0 * np.pi * (x["frequency_Hz"] * (1.0 + x["spread"] * place) * times + turns))
    return effect.size * total / np.sqrt(lines)
