"""An extended model as the sampled plant that a PI controls: heating, lagging relays, swinging beam, dead time.

    G = K [(1 - c)/(tau_1 s + 1) + c/(tau_2 s + 1)] [1 - m + m w^2/(s^2 + 2 zeta w s + w^2)] / (tau_d s + 1) e^(-d s)

Each residue r of a pole p of G without its dead time is sampled exactly behind a zero-order hold; of a dead time of l
whole periods and f of one, (r/p) [e^(p(1-f)h) - 1 + (e^(ph) - e^(p(1-f)h)) z^-1] / (z - e^(ph)) z^-l
(K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, section 2.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import residue

from rtctl.border.arrays import ComplexArray
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

APART = 1e-4
"""Relative distance below which poles are moved apart: the residue of a double pole has another form."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearLoop:
    """The plant around one working point, scaled to a gain of 1."""

    time_constant_s: float
    second_time_constant_s: float = 1.0
    share: float = 0.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    participation: float = 0.0
    frequency_hz: float = 0.0
    damping_ratio: float = 0.0

    def response(self, angle: NDArray[np.float64], period_s: float) -> ComplexArray:
        """Return G at z = e^(j angle), sampled every `period_s` behind a zero-order hold."""
        z = np.exp(1j * angle)
        residues, poles = self._partial_fractions()
        whole = math.floor(self.delay_s / period_s + 1e-9)
        part = max(self.delay_s / period_s - whole, 0.0)
        total = np.zeros_like(z)
        for r, p in zip(residues, poles, strict=True):
            early, full = np.exp(p * (1.0 - part) * period_s), np.exp(p * period_s)
            total += r / p * (early - 1.0 + (full - early) / z) / (z - full)
        return np.asarray(total * z**-whole)

    @property
    def slow_zero_candidates(self) -> tuple[float, float]:
        """Time constants [s] between which the PI's zero is sought."""
        times = [self.time_constant_s, *([self.second_time_constant_s] if self.share != 0.0 else [])]
        return 0.5 * min(times), 1.5 * (max(times) + self.lag_s)

    def _partial_fractions(self) -> tuple[ComplexArray, ComplexArray]:
        fast, slow = self.time_constant_s, self.second_time_constant_s
        slow = slow * (1.0 + APART) if abs(slow / fast - 1.0) < APART else slow
        numerator, denominator = np.array([1.0]), np.array([fast, 1.0])
        if self.share != 0.0:
            numerator = np.array([(1.0 - self.share) * slow + self.share * fast, 1.0])
            denominator = np.polymul(denominator, [slow, 1.0])
        if self.lag_s > 0.0:
            near = any(abs(self.lag_s / one - 1.0) < APART for one in (fast, slow))
            denominator = np.polymul(denominator, [self.lag_s * (1.0 + 3.0 * APART if near else 1.0), 1.0])
        if self.participation != 0.0:
            w, zeta, m = 2.0 * math.pi * self.frequency_hz, self.damping_ratio, self.participation
            mode = np.array([1.0 / w**2, 2.0 * zeta / w, 1.0])
            numerator = np.polymul(numerator, np.polyadd((1.0 - m) * mode, [m]))
            denominator = np.polymul(denominator, mode)
        residues, poles, direct = residue(numerator, denominator)
        assert not np.any(direct)
        return residues, poles


def linear_loop(dynamics: Vo2Dynamics, power: float, slope_share: float) -> LinearLoop:
    """Linearise a model around a surrogate power [mA^2].

    `slope_share` [1/mA^2] is how fast the phase fraction grows with the power there.
    """
    b = dynamics.balance
    capacity = 1.0 + (b.latent + b.phase_heating_known * power) * slope_share
    stiffness = 1.0 + 2.0 * b.loss * power - b.tcr * power
    return LinearLoop(
        time_constant_s=b.time_constant_s * capacity / max(stiffness, 0.1),
        second_time_constant_s=b.second_time_constant_s / max(stiffness, 0.1),
        share=b.share,
        lag_s=b.lag_s,
        delay_s=dynamics.delay_s,
        participation=dynamics.participation,
        frequency_hz=dynamics.frequency_hz,
        damping_ratio=dynamics.damping_ratio,
    )
