"""Several PID loops of the same gains around a sampled plant that a decoupler separates at rest.

    P(z) = C (z I - phi)^-1 gamma + D/z,   S(z) = (I + c(z) P(z))^-1,   c the PID

The eigenvalues of P(z) over frequency (its characteristic loci) are to c what a plant's response is to the PID of one
output; how far the loops amplify each other, the largest singular value of S tells, outputs over their ranges.

Reference: S. Skogestad, I. Postlethwaite, Multivariable Feedback Control, 2nd ed., sections 3.3 and 4.9.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.controllers.pid import PidGains
from rtctl.controllers.pid_tuning import ANGLES, DECAYS, discrete_pid, pid_response


@dataclass(frozen=True, slots=True, kw_only=True)
class SeveralPlant:
    """A plant x' = A x + B v, y = C x + D v about a point of rest, v and y in the units of the outputs."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray


class SampledPlant:
    """The plant behind a zero-order hold and a delay of whole periods."""

    def __init__(self, plant: SeveralPlant, widths: FloatArray, period_s: float, delay: int) -> None:
        """Sample the plant.

        Args:
            plant: The plant.
            widths: Range of each output (outputs,).
            period_s: Sample period [s].
            delay: Periods between a command and the first reading that knows of it, beyond one.
        """
        n, m = plant.b.shape
        whole = np.zeros((n + m, n + m))
        whole[:n, :n], whole[:n, n:] = plant.a, plant.b
        moved = expm(whole * period_s)
        self._phi, self._gamma = moved[:n, :n], moved[:n, n:]
        self._c, self._d, self._delay, self._period_s = plant.c, plant.d, delay, period_s
        z = np.exp(1j * ANGLES)
        states = np.linalg.solve(z[:, None, None] * np.eye(n) - self._phi, self._gamma.astype(np.complex128))
        response = (self._c @ states + self._d / z[:, None, None]) * (z**-delay)[:, None, None]
        self._scaled = response * widths / widths[:, None]

    def loci(self) -> ComplexArray:
        """Return the eigenvalues (outputs, angles) of the response at `ANGLES`."""
        return np.asarray(np.linalg.eigvals(self._scaled).T)

    def largest_sensitivity(self, gains: PidGains) -> float:
        """Return the largest singular value of S; infinite where the loops are unstable together."""
        if not self._is_stable(gains):
            return math.inf
        loop = self._scaled * pid_response(gains, np.exp(1j * ANGLES), self._period_s)[:, None, None]
        sensitivity = np.linalg.inv(np.eye(loop.shape[1]) + loop)
        return float(np.linalg.norm(sensitivity, ord=2, axis=(1, 2)).max())

    def _is_stable(self, gains: PidGains) -> bool:
        import control

        m, period_s = self._gamma.shape[1], self._period_s
        one_each = [
            control.append(*[control.ss(control.tf([1.0], [1.0] + [0.0] * periods, period_s))] * m)
            for periods in (1, self._delay)
        ]
        direct = control.ss([], [], [], self._d, period_s) * one_each[0]
        plant = control.ss(self._phi, self._gamma, self._c, np.zeros((m, m)), period_s) + direct
        pids = control.append(*[discrete_pid(gains, period_s)] * m)
        poles = control.feedback(plant * one_each[1] * pids, np.eye(m)).poles()
        return bool(np.all(np.abs(poles) < 1.0 - DECAYS))
