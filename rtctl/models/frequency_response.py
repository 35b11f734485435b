"""Forced vibration of an oscillator with odd restoring force by harmonic balance, followed through its folds.

    z'' + c z' + k z + k3 z^3 + k5 z^5 = f(theta),  theta = w t,   z = sum_n a_n cos(n theta) + b_n sin(n theta), n odd

The force is given over one cycle, so it may have harmonics of its own. Unknowns are a_n, b_n and w; Newton's method
with an exact Jacobian (alternating frequency/time) corrects a step along the tangent of the curve: pseudo-arclength
continuation, which passes a fold where a sweep would jump. Stability is Floquet's: the monodromy matrix of

    d'' + c d' + (k + 3 k3 z^2 + 5 k5 z^4) d = 0

over one period, as a product of exact steps with the stiffness of their middles; a motion is unstable where a
multiplier lies outside the unit circle. Their product is exp(-2 pi c / w) whatever the motion (Liouville).
Reference: M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems (Springer 2019), chapters 2 to 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import ComplexArray, FloatArray

HARMONICS = (1, 3, 5, 7)
SAMPLES = 128
"""Samples of one cycle."""
STABILITY_STEPS = 1024
"""Steps of one cycle: near a sharp peak the multipliers pass 1 so slowly that 128 would misplace it by 40 points."""
CONVERGED = 1e-11
MOST_ITERATIONS = 12
FIRST_STEP, LEAST_STEP, MOST_STEP = 0.05, 1e-6, 2.0
"""Steps of the arc, in amplitudes and half-widths of the linear resonance."""
STRAIGHT, BENT, TURNED = math.cos(0.03), math.cos(0.07), math.cos(0.2)
"""Cosines of the turn from one tangent to the next: a step may be longer, is shorter, is taken back."""
WIDEST = 0.04
"""Largest change of a coefficient in a step, in amplitudes: folds may lie close to each other."""
MOST_POINTS = 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class OddOscillator:
    """Mass-normalised oscillator with odd restoring force, lengths in the unit of z."""

    damping: float
    """Damping [1/s]."""
    stiffness: float
    """Linear stiffness [1/s^2]."""
    cubic: float = 0.0
    """Cubic stiffness [1/(z^2 s^2)]."""
    quintic: float = 0.0
    """Quintic stiffness [1/(z^4 s^2)]."""

    def __post_init__(self) -> None:
        if not self.damping > 0.0:
            raise ValueError(f"damping must be > 0 1/s for a forced response, got {self.damping!r}")
        if not self.stiffness > 0.0:
            raise ValueError(f"stiffness must be > 0 1/s^2, got {self.stiffness!r}")

    def force(self, z: FloatArray) -> FloatArray:
        """Return the nonlinear part of the restoring force [z/s^2]."""
        s = z * z
        return z * s * (self.cubic + self.quintic * s)

    def slope(self, z: FloatArray) -> FloatArray:
        """Return the derivative of the nonlinear part [1/s^2]."""
        s = z * z
        return s * (3.0 * self.cubic + 5.0 * self.quintic * s)


class Response(NamedTuple):
    """Points of the response curve, in order along it."""

    rate: FloatArray
    """Angular frequencies (n,) [rad/s]."""
    phasors: ComplexArray
    """Phasors (n, harmonics): z = Re sum_n phasor exp(i n theta)."""
    largest_multiplier: FloatArray
    """Magnitude (n,) of the largest Floquet multiplier; the motion is unstable above 1."""
    folds: NDArray[np.int64]
    """Indices of the points where the frequency reverses."""

    @property
    def amplitude(self) -> FloatArray:
        """Amplitude (n,) of the first harmonic."""
        return np.abs(self.phasors[:, 0])

    @property
    def peak(self) -> tuple[float, float]:
        """Rate [rad/s] and amplitude of the largest first harmonic, by a parabola over the arc through three points."""
        amplitude = self.amplitude
        at = int(np.clip(amplitude.argmax(), 1, len(amplitude) - 2))
        part = slice(at - 1, at + 2)
        rate, height = self.rate[part], amplitude[part]
        arc = np.concatenate(
            ([0.0], np.cumsum(np.hypot(np.diff(rate) / np.ptp(rate), np.diff(height) / height[1])))
        )
        bend, slope, base = np.polyfit(arc, height, 2)
        top = float(np.clip(-0.5 * slope / bend, arc[0], arc[-1])) if bend < 0.0 else float(arc[1])
        return float(np.polyval(np.polyfit(arc, rate, 2), top)), float(np.polyval((bend, slope, base), top))

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Which points (n,) are stable."""
        return self.largest_multiplier <= 1.0


class _Balance(NamedTuple):
    """Constants of the harmonic-balance equations."""

    oscillator: OddOscillator
    order: FloatArray
    """Harmonics (h,), n."""
    basis: FloatArray
    """Basis (2h, SAMPLES): cosines, then sines."""
    force: FloatArray
    """Force coefficients (2h,): cosines, then sines."""

    def residual(self, x: FloatArray, w: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the residual of x (2h,) at w, its Jacobian (2h, 2h), and its derivative by w (2h,)."""
        h, o = len(self.order), self.oscillator
        a, b, nw = x[:h], x[h:], self.order * w
        z = x @ self.basis
        linear = o.stiffness - nw * nw
        found = 2.0 / SAMPLES * (self.basis @ o.force(z)) - self.force
        found[:h] += linear * a + o.damping * nw * b
        found[h:] += linear * b - o.damping * nw * a
        jacobian = 2.0 / SAMPLES * (self.basis * o.slope(z)) @ self.basis.T
        jacobian[:h, :h] += np.diag(linear)
        jacobian[h:, h:] += np.diag(linear)
        jacobian[:h, h:] += np.diag(o.damping * nw)
        jacobian[h:, :h] -= np.diag(o.damping * nw)
        by_w = np.concatenate(
            (
                -2.0 * self.order * nw * a + o.damping * self.order * b,
                -2.0 * self.order * nw * b - o.damping * self.order * a,
            )
        )
        return found, jacobian, by_w


def cycle() -> FloatArray:
    """Return the angles (SAMPLES,) at which a force is given."""
    return np.asarray(2.0 * math.pi * np.arange(SAMPLES) / SAMPLES)


def frequency_response(
    oscillator: OddOscillator,
    force: FloatArray,
    low_rate: float,
    high_rate: float,
    *,
    harmonics: tuple[int, ...] = HARMONICS,
) -> Response:
    """Follow the response curve from `low_rate` to `high_rate`.

    Args:
        oscillator: Damping and stiffnesses.
        force: (SAMPLES,) force [z/s^2] at the angles of `cycle`.
        low_rate: First angular frequency [rad/s].
        high_rate: Last angular frequency [rad/s].
        harmonics: Odd harmonics of the motion.

    Raises:
        ValueError: An argument is not valid, or the curve does not reach the other end.
    """
    if not 0.0 < low_rate < high_rate:
        raise ValueError(f"0 < low_rate < high_rate is needed, got {low_rate!r} and {high_rate!r} rad/s")
    if np.shape(force) != (SAMPLES,):
        raise ValueError(f"force must have {SAMPLES} samples of one cycle, got {np.shape(force)}")
    balance = _balance(oscillator, force, harmonics)
    size = float(np.hypot(*balance.force[[0, len(harmonics)]])) / (
        oscillator.damping * math.sqrt(oscillator.stiffness)
    )
    scale = np.append(np.full(2 * len(harmonics), size), 0.5 * oscillator.damping)
    y = _first_point(balance, low_rate, scale)
    points, step = [y], FIRST_STEP
    tangent = _tangent(balance, y, scale, np.append(np.zeros(len(y) - 1), 1.0))
    while low_rate <= y[-1] * scale[-1] <= high_rate and len(points) < MOST_POINTS:
        corrected = _corrected(balance, y + step * tangent, tangent, scale)
        after = None if corrected is None else _tangent(balance, corrected, scale, tangent)
        turn = -1.0 if after is None else float(after @ tangent)
        if corrected is None or after is None or turn < TURNED or np.abs((corrected - y)[:-1]).max() > WIDEST:
            step *= 0.5
            if step < LEAST_STEP:
                raise ValueError(f"harmonic balance does not converge beyond {y[-1] * scale[-1]:.6g} rad/s")
            continue
        y, tangent = corrected, after
        points.append(y)
        step = min(step * (1.4 if turn > STRAIGHT else 1.0 if turn > BENT else 0.7), MOST_STEP)
    if y[-1] * scale[-1] < low_rate or len(points) == MOST_POINTS:
        raise ValueError(
            f"the curve does not reach {high_rate:.6g} rad/s: it ends at {y[-1] * scale[-1]:.6g}"
        )
    found = np.array(points) * scale
    h = len(harmonics)
    rate, phasors = found[:, -1], found[:, :h] - 1j * found[:, h:-1]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(rate)))) + 1
    return Response(rate, phasors, largest_multiplier(oscillator, rate, phasors, harmonics), turns)


def largest_multiplier(
    oscillator: OddOscillator, rate: FloatArray, phasors: ComplexArray, harmonics: tuple[int, ...] = HARMONICS
) -> FloatArray:
    """Return the magnitude (n,) of the larger Floquet multiplier of motions with `phasors` (n, harmonics)."""
    first, second = multipliers(oscillator, rate, phasors, harmonics)
    return np.asarray(np.maximum(np.abs(first), np.abs(second)))


def multipliers(
    oscillator: OddOscillator, rate: FloatArray, phasors: ComplexArray, harmonics: tuple[int, ...] = HARMONICS
) -> tuple[ComplexArray, ComplexArray]:
    """Return both Floquet multipliers (n,) of each motion."""
    middle = 2.0 * math.pi * (np.arange(STABILITY_STEPS) + 0.5) / STABILITY_STEPS
    waves = np.exp(1j * np.outer(np.array(harmonics), middle))
    z = (phasors @ waves).real
    stiffness = oscillator.stiffness + oscillator.slope(z)
    h = 2.0 * math.pi / (rate * STABILITY_STEPS)
    half = 0.5 * oscillator.damping
    root = np.sqrt((stiffness - half * half).astype(np.complex128))
    angle = root * h[:, None]
    cos = np.cos(angle).real
    sin_over = np.where(np.abs(root) > 0.0, np.sin(angle) / np.where(root == 0.0, 1.0, root), h[:, None]).real
    matrix = np.broadcast_to(np.eye(2), (len(rate), 2, 2)).copy()
    for i in range(STABILITY_STEPS):
        c, s, k = cos[:, i], sin_over[:, i], stiffness[:, i]
        step = np.stack((c + half * s, s, -k * s, c - half * s), axis=1).reshape(-1, 2, 2)
        matrix = step @ matrix
    trace = matrix[:, 0, 0] + matrix[:, 1, 1]
    turned = np.sqrt((0.25 * trace**2 - np.linalg.det(matrix)).astype(np.complex128))
    shrunk = np.exp(-half * h * STABILITY_STEPS)
    return shrunk * (0.5 * trace + turned), shrunk * (0.5 * trace - turned)


def _balance(oscillator: OddOscillator, force: FloatArray, harmonics: tuple[int, ...]) -> _Balance:
    order = np.array(harmonics, dtype=np.float64)
    angle = np.outer(order, cycle())
    basis = np.vstack((np.cos(angle), np.sin(angle)))
    return _Balance(oscillator, order, basis, 2.0 / SAMPLES * (basis @ force))


def _first_point(balance: _Balance, rate: float, scale: FloatArray) -> FloatArray:
    """Solve for the point at a fixed `rate`, from the linear response."""
    x = np.zeros(len(scale) - 1)
    for _ in range(50):
        residual, jacobian, _ = balance.residual(x, rate)
        change = np.linalg.solve(jacobian, -residual)
        x = x + change
        if np.abs(change / scale[:-1]).max() < CONVERGED:
            return np.append(x, rate) / scale
    raise ValueError(
        f"harmonic balance finds no motion at {rate:.6g} rad/s: start farther from the resonance"
    )


def _tangent(balance: _Balance, y: FloatArray, scale: FloatArray, before: FloatArray) -> FloatArray:
    """Return the unit tangent (2h + 1,) at y, all in scaled unknowns, in the direction of `before`."""
    _, jacobian, by_w = balance.residual(y[:-1] * scale[:-1], y[-1] * scale[-1])
    rows = np.hstack((jacobian * scale[:-1], (by_w * scale[-1])[:, None]))
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    found = np.linalg.solve(np.vstack((rows, before)), np.append(np.zeros(len(rows)), 1.0))
    return np.asarray(found / np.linalg.norm(found))


def _corrected(
    balance: _Balance, guess: FloatArray, tangent: FloatArray, scale: FloatArray
) -> FloatArray | None:
    """Correct by Newton's method in the plane through `guess` across the tangent; None without convergence."""
    y = guess
    for _ in range(MOST_ITERATIONS):
        residual, jacobian, by_w = balance.residual(y[:-1] * scale[:-1], y[-1] * scale[-1])
        rows = np.hstack((jacobian * scale[:-1], (by_w * scale[-1])[:, None]))
        size = np.abs(rows).max(axis=1)
        system = np.vstack((rows / size[:, None], tangent))
        change = np.linalg.solve(system, -np.append(residual / size, tangent @ (y - guess)))
        y = y + change
        if np.abs(change).max() < CONVERGED * max(1.0, float(np.abs(y).max())):
            return y
    return None
