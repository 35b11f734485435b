"""Control of a resonator: the coil's current holds the amplitude (AGC), the frequency holds the phase (PLL).

Near resonance, with sigma = omega0 / 2Q, the growth g = drive_gain / 2 omega0 and a phase phi behind the current,

    a' = -sigma a - g i sin phi,      phi' = omega_b(a) - omega - (g i / a) cos phi

so at phi = -90 deg both are first-order lags with the pole sigma, g/(s + sigma) and -1/(s + sigma). Each PI has its
zero there (Ki = sigma Kp): the open loops are integrators, of bandwidth g Kp_a and Kp_phi.

The AGC starts from a kick: a share of the current that the model holds the setpoint with. It takes over when the
response stands out of the noise and the phase is within `ENGAGED_DEG` of its setpoint, and gives the current back
when the response is lost: a resonator that does not answer is never driven harder. The PLL holds its frequency until
there is a response. Where limits hold the current back, the integral is what holds the present amplitude: then the
cancelled pole is not excited when the limit lets go, and nothing has wound up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rtctl.controllers.agc_pll_tuning import AgcPllTuning
from rtctl.interfaces import ControlAction, Estimate, EstimateStatus
from rtctl.models.resonator import ResonatorModel

ENGAGED_DEG = 45.0
_NOT_FINITE = int(EstimateStatus.NOT_FINITE)


class LoopTerms(NamedTuple):
    """Terms of both commands."""

    current_proportional: float
    current_integral: float
    frequency_proportional: float
    frequency_integral: float
    state: float
    """Loops that act: 0: kick, no response; 1: PLL only; 2: both loops."""


TERMS = tuple(zip(LoopTerms._fields, ("mA", "mA", "Hz", "Hz", ""), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class AgcPllOptions:
    """Options besides the tuning."""

    phase_deg: float = -90.0
    """Setpoint of the displacement's phase against the coil current [deg]."""
    gate: float = 20.0
    """Least response, in standard errors of the estimate."""
    kick: float = 0.5
    """Current of the kick, as a share of the one that holds the setpoint."""


def turned(phase_deg: float) -> float:
    """Return a phase difference within [-180, 180) deg; NaN stays NaN and ends the run."""
    return (phase_deg + 180.0) % 360.0 - 180.0


class AgcPllController:
    """The controller of current [mA] and frequency [Hz]; its setpoint is an amplitude [um]."""

    terms = TERMS
    preview_s = 0.0

    def __init__(self, model: ResonatorModel, tuning: AgcPllTuning, options: AgcPllOptions) -> None:
        self.tuning = tuning
        self._model = model
        self._options = options
        self._engaged = False
        self._amplitude = 0.0
        self._current = 0.0
        self._frequency = model.resonance / (2.0 * math.pi)
        self._asked = (0.0, self._frequency)

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start from rest: no current flows, so the frequency may start at the model's linear resonance."""
        self._engaged = False
        self._amplitude = estimate.value
        self._current = 0.0
        self._frequency = self._model.resonance / (2.0 * math.pi)

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Step both loops, or as many as the response allows; see `Controller`."""
        self._amplitude = estimate.value
        responds = estimate.value > self._options.gate * estimate.confidence and not (
            estimate.status & _NOT_FINITE
        )
        phase_error = turned(estimate.surrogate - self._options.phase_deg) if responds else 0.0
        if responds and not self._engaged and abs(phase_error) < ENGAGED_DEG:
            self._engaged = True
            self._current = self._model.holding_current(estimate.value)
        self._engaged = self._engaged and responds
        frequency_terms = self._phase_terms(phase_error, elapsed_s)
        current_terms = self._amplitude_terms(setpoint, estimate.value, elapsed_s)
        self._asked = (sum(current_terms), sum(frequency_terms))
        state = float(responds) + float(self._engaged)
        return ControlAction(self._asked, LoopTerms(*current_terms, *frequency_terms, state))

    def _phase_terms(self, error_deg: float, elapsed_s: float) -> tuple[float, float]:
        self._frequency += self.tuning.ki_hz_per_deg_s * error_deg * elapsed_s
        return self.tuning.kp_hz_per_deg * error_deg, self._frequency

    def _amplitude_terms(self, setpoint: float, amplitude: float, elapsed_s: float) -> tuple[float, float]:
        if not self._engaged:
            self._current = self._options.kick * self._model.holding_current(setpoint)
            return 0.0, self._current
        error = setpoint - amplitude
        share = self._model.decay_at(amplitude) / self._model.decay  # the zero follows the pole
        self._current += share * self.tuning.ki_mA_per_um_s * error * elapsed_s
        return self.tuning.kp_mA_per_um * error, self._current

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from both integrals what the limits did not let through (anti-windup)."""
        if levels[0] != self._asked[0] and self._engaged:
            self._current = self._model.holding_current(self._amplitude)
        if levels[1] != self._asked[1]:
            self._frequency += levels[1] - self._asked[1]
