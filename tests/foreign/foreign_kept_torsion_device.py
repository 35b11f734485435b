"""A bar on a fibre, turned by a torque: the readings of an angle, with hidden effects and without.

What is hidden has the names of `foreign_oscillator_device.EFFECTS`; the torsion lab's own forms of them stand in
`EQUATIONS`. At size zero each of them vanishes.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from foreign_common import Array
from foreign_kept_torsion_motion import (
    ANGLE,
    FAST,
    HYSTERETIC,
    LAGGED,
    MODE,
    MODE_RATE,
    RATE,
    SLOW,
    STATES,
    swing,
)
from foreign_oscillator_device import (
    DRIVE,
    EFFECTS,
    HOLDS,
    Device,
    Effect,
    Record,
    acting_drive,
    base_acceleration,
    changed_law,
    natural_square,
    rest_position,
)
from foreign_oscillator_motion import Law
from foreign_response_device import behind_electronics, forms_of, read_out
from scipy.interpolate import make_interp_spline

PIECES = 5  # of a sample period; in each the drive is a parabola
SMALLEST = 1e-12  # size of a state, in its unit
LONGEST_LEAD = 8000  # samples of a base that moves before the record begins

EQUATIONS = EFFECTS | {
    "stiffness.viscoelastic": "two parts relax, s / 2 each, with the times tau / 2 and 2 tau",
    "friction.coulomb:smooth": "s z' / sqrt(z'^2 + v^2)",
    "friction.stribeck": "(s + (b - 1) s exp(-|z'| / v)) sign(z'), and the bar sticks up to b s",
    "stop.one_sided": "another spring beyond z = A (1 - s), with Hunt and Crossley's loss",
    "stop.two_sided": "another spring beyond |z| = A (1 - s), with Hunt and Crossley's loss",
    "damping.power": "+ s |z'|^n sign(z'), n of 0.4, 1.4, 1.8 or 2.6",
    "sensor.saturation": "'soft': (2 A / (pi s)) atan(pi s y / (2 A)); 'hard': cut at A (1 - s)",
    "sensor.drift": "reading + s (1 - exp(-3 t / T)) / (1 - exp(-3)), or s (t / T)^1.5, in each record of length T",
    "sensor.hum": "reading + s (sin p + 0.25 sin(2 p + 2)), p = 2 pi f t + phase of the record, f that of the mains",
    "sensor.lag": "s r' = z - r, r is read, z with the second mode",
}


class Swing(NamedTuple):
    """Of each row, before noise: the reading, the angle [rad]; angle and rate in which the first row finds it."""

    reading: Array
    angle: Array
    start: tuple[float, float]


def simulate(
    device: Device, record: Record, effects: tuple[Effect, ...] = (), start: tuple[float, float] | None = None
) -> Swing:
    """Readings [rad] of one record; `start`: angle and rate, if not at rest (under the offset of the drive)."""
    effects = tuple(effect for effect in effects if effect.size != 0.0)
    law, found = changed_law(device.law, effects), {effect.name: effect for effect in effects}
    skew, h = found.get("timing.skew"), device.period_s / PIECES
    late = skew.size * skew.values["sign"] if skew else 0.0
    lead = 0
    if "base.motion" in found and start is None:  # which did not begin with the record
        lead = min(round(2.0 * np.pi / device.law.damping / device.period_s), LONGEST_LEAD)
    drive, times = _drive(device, record, effects, lead, 2 + max(ceil(late / device.period_s), 0))
    base = base_acceleration(found.get("base.motion"), times, record.seed)
    y = _first(law, found, start)
    fine = swing(law, drive, base, h, float(times[0, 0]), y, _scale(law, record.drive, y))
    seen = fine[:, 0] + (fine[:, 2] if law.mode_gain else 0.0)
    seen = behind_electronics(seen, h, found)
    first = PIECES * lead
    rows = first + PIECES * (int(device.read_at_end) + np.arange(record.drive.size))
    reading = seen[rows]
    if late and np.isfinite(seen).all():
        places = np.clip(rows + late / h, 0.0, seen.size - 1.0)
        reading = make_interp_spline(np.arange(seen.size), seen, 3)(places)
    reading = read_out(reading, READING, effects, device.period_s, record.seed)
    return Swing(reading, fine[rows, 0], (float(fine[first, 0]), float(fine[first, 1])))


def _drive(
    device: Device, record: Record, effects: tuple[Effect, ...], lead: int, after: int
) -> tuple[Array, Array]:
    """What acts of the drive, and the times [s] from the first row, both (pieces, 3); `lead`, `after`: samples."""
    hold, delay = device.hold, 0
    for effect in effects:
        if effect.name == "input.hold":
            hold = HOLDS[int(effect.values["hold"])]
        if effect.name == "drive.delay":
            delay = round(effect.size / device.period_s * PIECES)
    samples = np.concatenate([np.zeros(lead), record.drive, np.full(after, record.drive[-1])])
    nodes = acting_drive(samples, hold, PIECES)
    nodes = np.concatenate([np.zeros((delay, 3)), nodes])[: nodes.shape[0]]
    places = np.arange(nodes.shape[0])[:, None] + np.array([0.0, 0.5, 1.0])
    times = device.period_s * (places / PIECES - lead)
    for effect in effects:
        if effect.name in DRIVE:
            acting = DRIVE[effect.name](nodes.ravel(), times.ravel(), effect.size, effect.values)
            nodes = acting.reshape(-1, 3)
    return nodes, times


def _first(law: Law, found: dict[str, Effect], start: tuple[float, float] | None) -> Array:
    """First states: at rest under the offset of the drive, or in a known angle and rate."""
    offset, y = found.get("drive.offset"), np.zeros(STATES)
    constant = offset.size * offset.values["sign"] if offset else 0.0
    y[ANGLE] = y[FAST] = y[SLOW] = rest_position(law, law.gain * constant, 0.0)
    y[LAGGED] = constant
    if law.mode_rad_s > 0.0:
        y[MODE] = y[ANGLE] if law.mode_mass else law.mode_gain * constant / law.mode_rad_s**2
    if start is not None:
        y[ANGLE], y[RATE] = start
    return y


def _scale(law: Law, drive: Array, y: Array) -> Array:
    """Sizes of the states: of the angle, the static answer to the drive's RMS, or where it begins if that is more."""
    loud = float(np.sqrt(np.mean(drive**2)))
    angle = max(abs(law.gain) * loud / natural_square(law), abs(float(y[ANGLE])), SMALLEST)
    loud = max(loud, SMALLEST)
    scale = np.full(STATES, angle)
    scale[RATE], scale[HYSTERETIC], scale[LAGGED] = angle * np.sqrt(natural_square(law)), 1.0, loud
    if law.mode_gain:
        scale[MODE] = abs(law.mode_gain) * loud / law.mode_rad_s**2
    scale[MODE_RATE] = scale[MODE] * max(law.mode_rad_s, 1.0)
    return scale


def _cut(y: Array, s: float, x: dict[str, float]) -> Array:
    if x["hard"]:
        return np.clip(y, -x["A"] * (1.0 - s), x["A"] * (1.0 - s))
    bent = 0.5 * np.pi * s / x["A"]
    return np.asarray(np.arctan(bent * y) / bent)


def _drifted(t: Array, x: dict[str, float]) -> Array:
    place = t / t[-1]
    settling = np.expm1(-3.0 * place) / np.expm1(-3.0)
    return np.asarray(settling if x["exponent"] == 1.0 else place**1.5)


def _hum(t: Array, seed: int, x: dict[str, float]) -> Array:
    phase = 2.0 * np.pi * (x["frequency_Hz"] * t + float(np.random.default_rng([seed, 52]).random()))
    return np.sin(phase) + 0.25 * np.sin(2.0 * phase + 2.0)


READING = forms_of(_cut, _drifted, _hum)
