"""Start values of a linear oscillator by separable least squares: two poles on a grid, all else by linear regression.

At given poles the reading is linear in the drive's gain, in a constant and in the two numbers of the start. So a grid
of natural frequencies and damping ratios, refined from its best points, finds the least error of a free run over all
linear oscillators, also over those that do not oscillate: their acceleration is noise, and no regression on it starts.

Reference: G. Golub, V. Pereyra, Separable nonlinear least squares, Inverse Problems 19 (2003) R1, section 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit_record import FitRecord, derivative_order, response_of

FREQUENCIES = 24  # of the grid
RATIOS = (0.01, 0.03, 0.1, 0.3, 0.7, 1.5, 4.0, 12.0, 40.0)
"""Damping ratios of the grid; at 40 one pole is 6,400 times as fast as the other."""
FEWEST_PERIODS = 0.5
"""Periods of the lowest natural frequency of the grid in the longest record."""
REFINED = 2  # points of the grid
MOST_SAMPLES = 20_000
"""Samples of a record, from its first scored one on, that are compared."""
MOST_RECORDS = 6
FASTEST = 3.0
"""Fastest pole over the sample rate [1/s]: one that is faster changes no sample by more than a twentieth."""
HIGHEST_RESONANCE = 2.0
"""Highest angular frequency of a resonance over the sample rate [1/s], three samples a period: one above it fits
whatever follows its drive at once, as nothing excites it."""
RESONANT = 0.7  # damping ratio below which a response has a peak
APART = 1e-4
"""Distance of the damping ratio from 1 below which two equal poles are taken as two that differ a little."""


class LinearFit(NamedTuple):
    """A linear oscillator in the units of the data."""

    damping: float
    """[1/s]."""
    stiffness: float
    """[1/s^2]."""
    drive_gain: float
    residual_share: float
    """RMS error of free runs, starts and a constant fitted, relative to the motion."""


class _Part(NamedTuple):
    drive: FloatArray
    reading: FloatArray
    period_s: float
    hold: str
    order: int
    """Derivative of the displacement that was read."""


def fit_linear(records: Sequence[FitRecord]) -> LinearFit | None:
    """Return the linear oscillator that free runs follow best; None where no drive varies or no response was read.

    Args:
        records: Records; the first samples of the first few are compared.
    """
    parts = [part for record in records[:MOST_RECORDS] if (part := _part_of(record)) is not None]
    if not parts:
        return None
    longest = max(len(part.reading) * part.period_s for part in parts)
    shortest_period = min(part.period_s for part in parts)
    lowest, highest = 2.0 * np.pi * FEWEST_PERIODS / longest, np.pi / shortest_period
    grid = [
        np.log([rate, ratio])
        for rate in np.geomspace(lowest, highest, FREQUENCIES)
        for ratio in RATIOS
        if _is_seen(rate, ratio, shortest_period)
    ]

    def error(point: FloatArray) -> float:
        rate, ratio = np.exp(point)
        return _solve(parts, rate, ratio)[1] if _is_seen(rate, ratio, shortest_period) else np.inf

    ranked = sorted(grid, key=error)
    found = [
        minimize(
            error, start, method="Nelder-Mead", options={"maxfev": 60, "initial_simplex": _simplex(start)}
        )
        for start in ranked[:REFINED]
    ]
    best = min(found, key=lambda one: float(one.fun))
    rate, ratio = np.exp(best.x)
    gain, left = _solve(parts, rate, ratio)
    return LinearFit(float(2.0 * ratio * rate), float(rate**2), gain, left)


def _simplex(start: FloatArray) -> FloatArray:
    corners: FloatArray = start + np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.3]])
    return corners


def _is_seen(rate: float, ratio: float, period_s: float) -> bool:
    """Return whether samples show a resonance, or both poles [1/s] of a response without one."""
    if ratio < RESONANT:
        return rate <= HIGHEST_RESONANCE / period_s
    return bool(rate * (ratio + np.sqrt(max(ratio**2 - 1.0, 0.0))) <= FASTEST / period_s)


def _part_of(record: FitRecord) -> _Part | None:
    name, drive = response_of([record]), record.stimulus.inputs.get("drive")
    if drive is None or not np.ptp(drive) or not name:
        return None
    kept = slice(record.first, record.first + MOST_SAMPLES)
    hold = record.stimulus.holds.get("drive", "linear")
    return _Part(drive[kept], record.measured[name][kept], record.period_s, hold, derivative_order(name))


def _solve(parts: Sequence[_Part], rate: float, ratio: float) -> tuple[float, float]:
    """Return the gain of the drive at these poles, and the RMS error relative to the motion.

    The records share the gain; each has a start and a constant of its own, which are projected out.
    """
    across = within = size = 0.0
    for part in parts:
        response, own = _columns(part, rate, ratio)
        basis, _ = np.linalg.qr(own)
        reading = part.reading - basis @ (basis.T @ part.reading)
        response = response - basis @ (basis.T @ response)
        about = part.reading - part.reading.mean()
        scale = 1.0 / max(float(about @ about), 1e-300)  # each record by its own motion
        across += scale * float(response @ reading)
        within += scale * float(response @ response)
        size += scale * float(reading @ reading)
    gain = across / within if within > 0.0 else 0.0
    return gain, float(np.sqrt(max(size - gain * across, 0.0) / len(parts)))


def _columns(part: _Part, rate: float, ratio: float) -> tuple[FloatArray, FloatArray]:
    """Return the response to the drive (n,) at gain 1, and what a start and a constant add (n, 3)."""
    above, below = _discretise(part, rate, ratio)
    response = lfilter(above, below, part.drive)
    impulse = np.zeros(len(part.drive))
    impulse[0] = 1.0
    free = lfilter([1.0], below, impulse)
    own = np.column_stack((np.ones_like(free), free, np.concatenate(([0.0], free[:-1]))))
    return response, own


def _discretise(part: _Part, rate: float, ratio: float) -> tuple[FloatArray, FloatArray]:
    """Return numerator and denominator (3,) of the sampled response s^order / (s^2 + 2 ratio rate s + rate^2).

    Exact for a drive that is held, or that is linear between its samples: the sum of two poles of the first order.
    """
    if abs(ratio - 1.0) < APART:
        ratio = 1.0 + APART
    root = np.sqrt(complex(ratio**2 - 1.0))
    poles = rate * np.array([-ratio + root, -ratio - root])
    residues = poles**part.order / np.array([poles[0] - poles[1], poles[1] - poles[0]])
    decay = np.exp(poles * part.period_s)
    held = (decay - 1.0) / poles  # response of a pole after a period to a drive of 1
    ramp = (held - part.period_s) / (poles * part.period_s)  # to one that rises from 0 to 1
    now, next_ = (held, 0.0 * held) if part.hold == "zero" else (held - ramp, ramp)
    direct = 1.0 if part.order == 2 else 0.0
    one, other = residues[0] * np.array([next_[0], now[0]]), residues[1] * np.array([next_[1], now[1]])
    below = np.convolve([1.0, -decay[0]], [1.0, -decay[1]])
    above = np.convolve(one, [1.0, -decay[1]]) + np.convolve(other, [1.0, -decay[0]]) + direct * below
    return above.real, below.real
