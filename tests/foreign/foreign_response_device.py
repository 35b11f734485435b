"""An oscillator seen by displacement or acceleration: the equation of `foreign_oscillator_motion`, read anew.

What is hidden has the names of `foreign_oscillator_device.EFFECTS` and their equations, but for the forms in `READING`,
and for lag and AC coupling, which act on whatever is read. At size zero each of them vanishes.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from foreign_oscillator_device import (
    DRIVE,
    EFFECTS,
    HOLDS,
    LONGEST_LEAD,
    Device,
    Effect,
    Record,
    acting_drive,
    base_acceleration,
    changed_law,
    rest_position,
    steps_of,
)
from foreign_oscillator_motion import (
    BEYOND,
    LAGGED_DRIVE,
    MODE,
    MODE_RATE,
    RELAXING,
    STATES,
    Law,
    V,
    Z,
    rates,
    take_step,
)
from numba import njit
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

EQUATIONS = EFFECTS | {
    "sensor.saturation": "'soft': y / (1 + |s y / A|^4)^(1/4); 'hard': cut at A (1 - s), A the largest reading",
    "sensor.drift": "reading + s ln(1 + 20 t / T) / ln 21, or s (t / T)^0.5, in each record of length T",
    "sensor.hum": "reading + s (sin p + 0.3 sin(3 p + 1)), p = 2 pi f t + phase of the record, f that of the mains",
    "sensor.lag": "s r' = y - r, r is read; y is the displacement or the acceleration",
    "sensor.highpass": "reading y - m, m' = 2 pi s (y - m): AC coupling with corner s",
    "damping.power": "+ s |z'|^n sign(z'), n of 0.3, 0.7, 1.6 or 2.5",
}

Values = dict[str, float]
# reading, t [s], seed of the record, size, values -> reading
Form = Callable[[Array, Array, int, float, Values], Array]


class Response(NamedTuple):
    """Of each row, before noise: the reading; and the displacement and velocity in which the first row finds it."""

    reading: Array
    motion: Array  # displacement at the rows
    start: tuple[float, float]


@njit(cache=True)
def run(law: Law, drive: Array, base: Array, h: float, t: float, y: Array) -> Array:
    """z, z', z'', q and q'' at the edges of all steps, (steps + 1, 5); NaN from where the motion diverges.

    `drive`, `base`: values at start, middle and end of each step, (steps, 3); `t` [s]: of the first; `y`: first states.
    """
    steps = drive.shape[0]
    out = np.full((steps + 1, 5), np.nan)
    dry = (law.sliding + law.breakaway > 0.0) and law.smooth_speed == 0.0
    stops = law.stop_stiffness > 0.0
    active = (
        dry or law.damping_v2 != 0.0 or law.power != 0.0 or law.hysteretic != 0.0,
        law.clearance > 0.0,
        law.clearance > 0.0,
        stops,
        stops and law.stop_sides > 1.5,
    )
    y, work, dy = y.copy(), np.zeros((5, STATES)), np.zeros(STATES)
    side = np.sign(y[V])
    for k in range(steps + 1):
        last = min(k, steps - 1)
        node = 0 if k < steps else 2
        rates(y, t + k * h, drive[last, node], base[last, node], law, side, dry, dy)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4] = y[Z], y[V], dy[V], y[MODE], dy[MODE_RATE]
        if k == steps or not abs(y[Z]) < BEYOND:
            return out
        side = take_step(y, t + k * h, h, drive[k], base[k], law, side, dry, active, work)
    return out


def simulate(
    device: Device,
    record: Record,
    response: str,
    effects: tuple[Effect, ...] = (),
    steps: int | None = None,
    start: tuple[float, float] | None = None,
) -> Response:
    """Readings of one record, which begins at rest; `response`: "displacement" | "acceleration", in the law's units.

    `steps`: integration steps in a sample period, if not as many as these effects need; `start`: displacement and
    velocity, if not at rest (under the offset of the drive if there is one).
    """
    effects = tuple(effect for effect in effects if effect.size != 0.0)
    law, found = changed_law(device.law, effects), {effect.name: effect for effect in effects}
    law = law._replace(reading_lag_s=0.0)
    steps = steps or steps_of(device, law)
    h, skew = device.period_s / steps, found.get("timing.skew")
    late = skew.size * skew.values["sign"] if skew else 0.0
    lead = 0
    if "base.motion" in found:  # which did not begin with the record
        lead = min(round(2.0 * np.pi / device.law.damping / device.period_s), LONGEST_LEAD)
    drive, times = _drive(
        device, record, found, effects, steps, lead, 2 + max(ceil(late / device.period_s), 0)
    )
    base = base_acceleration(found.get("base.motion"), times, record.seed)
    states = run(law, drive, base, h, float(times[0, 0]), _first(law, device, found, start))
    if response == "displacement":
        seen = states[:, 0] + (states[:, 3] if law.mode_gain else 0.0)
    else:
        seen = states[:, 2] + (states[:, 4] if law.mode_gain else 0.0)
    seen = behind_electronics(seen, h, found)
    first = steps * lead
    rows = first + steps * (int(device.read_at_end) + np.arange(record.drive.size))
    places = np.clip(rows + late / h, 0.0, seen.size - 1.0)
    if late and response == "displacement" and np.isfinite(seen).all():
        reading = CubicSpline(np.arange(seen.size), seen)(places)
    else:
        reading = np.interp(places, np.arange(seen.size), seen) if late else seen[rows]
    reading = read_out(reading, READING, effects, device.period_s, record.seed)
    return Response(reading, states[rows, 0], (float(states[first, 0]), float(states[first, 1])))


def follow(signal: Array, tau: float, step: float) -> Array:
    """First-order lag of a signal that is straight between its points, at rest at its first value."""
    a = np.exp(-step / tau)
    slope = tau / step * (1.0 - a)
    return signal[0] + lfilter([1.0 - slope, slope - a], [1.0, -a], signal - signal[0])


def behind_electronics(seen: Array, step: float, found: dict[str, Effect]) -> Array:
    """What a reading's lag and its AC coupling make of it; `step` [s] between its points."""
    if lag := found.get("sensor.lag"):
        seen = follow(seen, lag.size, step)
    if coupling := found.get("sensor.highpass"):
        seen = seen - follow(seen, 1.0 / (2.0 * np.pi * coupling.size), step)
    return seen


def read_out(
    reading: Array, forms: dict[str, Form], effects: tuple[Effect, ...], period_s: float, seed: int
) -> Array:
    """The reading of all rows with what the effects of a sensor, in a lab's own forms, do to it."""
    at_rows = period_s * np.arange(reading.size)
    for effect in effects:
        if effect.name in forms:
            reading = forms[effect.name](reading, at_rows, seed, effect.size, effect.values)
    return reading


def forms_of(
    cut: Callable[[Array, float, Values], Array],
    drifted: Callable[[Array, Values], Array],
    hum: Callable[[Array, int, Values], Array],
) -> dict[str, Form]:
    """Effects of a sensor: a lab's own forms of saturation, drift and hum, and what is alike in all of them."""
    return {
        "sensor.saturation": lambda y, t, k, s, x: cut(y, s, x),
        "sensor.offset": lambda y, t, k, s, x: y + s * x["sign"],
        "sensor.drift": lambda y, t, k, s, x: y + s * x["sign"] * drifted(t, x),
        "sensor.hum": lambda y, t, k, s, x: y + s * hum(t, k, x),
        "sensor.quantisation": lambda y, t, k, s, x: s * np.round(y / s),
    }


def _drive(
    device: Device,
    record: Record,
    found: dict[str, Effect],
    effects: tuple[Effect, ...],
    steps: int,
    lead: int,
    after: int,
) -> tuple[Array, Array]:
    """What acts of the drive, and the times [s] from the first row, both (steps, 3); `lead`, `after`: samples."""
    hold = device.hold
    if "input.hold" in found:
        hold = HOLDS[int(found["input.hold"].values["hold"])]
    samples = np.concatenate([np.zeros(lead), record.drive, np.full(after, record.drive[-1])])
    drive, h = acting_drive(samples, hold, steps), device.period_s / steps
    delay = round(found["drive.delay"].size / h) if "drive.delay" in found else 0
    drive = np.concatenate([np.zeros((delay, 3)), drive])[: drive.shape[0]]
    times = h * (np.arange(drive.shape[0])[:, None] + np.array([0.0, 0.5, 1.0]))
    times -= lead * device.period_s
    for effect in effects:
        if effect.name in DRIVE:
            acting = DRIVE[effect.name](drive.ravel(), times.ravel(), effect.size, effect.values)
            drive = acting.reshape(-1, 3)
    return drive, times


def _first(law: Law, device: Device, found: dict[str, Effect], start: tuple[float, float] | None) -> Array:
    """First states: at rest under the offset of the drive, or in a known displacement and velocity."""
    offset = found.get("drive.offset")
    constant = offset.size * offset.values["sign"] if offset else 0.0
    y = np.zeros(STATES)
    y[Z] = rest_position(law, law.gain * constant, device.rest)
    y[RELAXING], y[LAGGED_DRIVE] = y[Z], constant
    y[MODE] = y[Z] if law.mode_mass else law.mode_gain * constant / max(law.mode_rad_s, 1e-9) ** 2
    if start is not None:
        y[Z], y[V] = start
    return y


def _cut(y: Array, s: float, x: dict[str, float]) -> Array:
    if x["hard"]:
        return np.clip(y, -x["A"] * (1.0 - s), x["A"] * (1.0 - s))
    return y / (1.0 + (s * y / x["A"]) ** 4) ** 0.25


def _drifted(t: Array, x: dict[str, float]) -> Array:
    place = t / t[-1]
    return np.log1p(20.0 * place) / np.log(21.0) if x["exponent"] == 1.0 else np.sqrt(place)


def _hum(t: Array, seed: int, x: dict[str, float]) -> Array:
    phase = 2.0 * np.pi * (x["frequency_Hz"] * t + float(np.random.default_rng([seed, 51]).random()))
    return np.sin(phase) + 0.3 * np.sin(3.0 * phase + 1.0)


READING = forms_of(_cut, _drifted, _hum)
