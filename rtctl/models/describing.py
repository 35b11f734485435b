"""Describing functions of a resonator's nonlinearities for a motion z = a cos(w t).

Equivalent damping of the forces against the motion,

    c(a) = c + c_2 a^2 / 4 + 8 c_q w a / (3 pi) + 4 F / (pi w a)       z^2 z', |z'| z', dry friction

and the first harmonic of a reading tanh(sqrt(k) z) / sqrt(k), by quadrature over half a cycle.
Reference: M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems (Springer 2019), chapter 2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

POINTS = 64
_COSINE: NDArray[np.float64] = np.cos(math.pi * (np.arange(POINTS) + 0.5) / POINTS)


def equivalent_damping(
    amplitude: float, rate: float, linear: float, squared: float, quadratic: float, friction: float
) -> float:
    """Return c(a) [1/s].

    Args:
        amplitude: Amplitude [um]; > 0 where there is friction.
        rate: Angular frequency [rad/s].
        linear: c [1/s].
        squared: c_2 of z^2 z' [1/(um^2 s)].
        quadratic: c_q of |z'| z' [1/um].
        friction: F [um/s^2].
    """
    c: float = (
        linear
        + 0.25 * squared * (amplitude * amplitude)
        + 8.0 / (3.0 * math.pi) * quadratic * rate * amplitude
    )
    return c + (4.0 * friction / (math.pi * rate * amplitude) if friction != 0.0 else 0.0)


def saturated_amplitude(amplitude: float, curvature: float) -> float:
    """Return the first harmonic of the saturated reading of a motion of `amplitude` [um]; curvature [1/um^2]."""
    if curvature == 0.0:
        return amplitude
    root = math.sqrt(curvature)
    return float(2.0 * np.mean(np.tanh(root * amplitude * _COSINE) / root * _COSINE))


def unsaturated_amplitude(reading: float, curvature: float, most: float = 1e6) -> float:
    """Return the amplitude whose saturated reading has this first harmonic; `most` [um] where there is none."""
    if curvature == 0.0 or reading <= 0.0:
        return reading
    amplitude = reading
    for _ in range(30):  # Newton; the function is concave and rising, so it never overshoots from below
        here = saturated_amplitude(amplitude, curvature)
        h = 1e-6 * max(amplitude, 1e-9)
        slope = (saturated_amplitude(amplitude + h, curvature) - here) / h
        if not slope > 1e-6:
            return most
        following = amplitude + (reading - here) / slope
        if abs(following - amplitude) < 1e-10 * following:
            return following
        amplitude = following
    return amplitude if amplitude < most else most
