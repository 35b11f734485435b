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
from typing import Any, NamedTuple

from rtctl.controllers.agc_pll_tuning import AgcPllTuning
from rtctl.interfaces import ControlAction, Estimate, EstimateStatus
from rtctl.models.resonator import ResonatorModel, decay_at, holding_current

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


class AgcPllParams(NamedTuple):
    """Parameters of both loops."""

    kp_mA_per_um: float
    ki_mA_per_um_s: float
    kp_hz_per_deg: float
    ki_hz_per_deg_s: float
    phase_deg: float
    """Setpoint of the phase [deg]."""
    gate: float
    """Least response, in standard errors of the estimate."""
    kick: float
    """Current of the kick, as a share of the one that holds the setpoint."""
    resonance_hz: float
    """Frequency at the start [Hz]."""


@dataclass(slots=True)
class AgcPllMemory:
    """Memory of `agc_pll_step`."""

    engaged: int = 0
    """1: the amplitude loop acts."""
    amplitude: float = 0.0
    """The last one [um]."""
    current: float = 0.0
    """Integral of the amplitude loop [mA]."""
    shift_hz: float = 0.0
    """Integral of the phase loop: frequency less the linear resonance [Hz]."""
    asked: float = 0.0
    """Current that was asked for last [mA]."""
    asked_hz: float = 0.0
    """Frequency that was asked for last [Hz]."""


def turned(phase_deg: float) -> float:
    """Return a phase difference from -540 to 540 deg within [-180, 180) deg; NaN stays NaN and ends the run."""
    if phase_deg >= 180.0:
        return phase_deg - 360.0
    return phase_deg + 360.0 if phase_deg < -180.0 else phase_deg


# 8 parameters because the translated language has no objects
def agc_pll_step(  # noqa: PLR0913
    s: Any, model: Any, p: AgcPllParams, setpoint: float, amplitude: float, phase_deg: float, error: float,
    status: int, elapsed_s: float,
) -> LoopTerms:  # fmt: skip
    """Step both loops, or as many as the response allows; advance `AgcPllMemory` in place.

    Args:
        s: the memory; what is asked for is its `asked` [mA] and `asked_hz` [Hz].
        model: fields of `rtctl.models.resonator.ResonatorParams`.
        p: parameters.
        setpoint: amplitude [um].
        amplitude: its estimate [um].
        phase_deg: estimate of the phase [deg].
        error: standard error of the amplitude [um].
        status: status bits of the estimate.
        elapsed_s: time since the sample before [s].
    """
    s.amplitude = amplitude
    responds = amplitude > p.gate * error and status & _NOT_FINITE == 0
    phase_error = turned(phase_deg - p.phase_deg) if responds else 0.0
    if responds and s.engaged == 0 and abs(phase_error) < ENGAGED_DEG:
        s.engaged = 1
        s.current = holding_current(amplitude, model)
    if not responds:
        s.engaged = 0
    s.shift_hz += p.ki_hz_per_deg_s * phase_error * elapsed_s
    frequency_proportional = p.kp_hz_per_deg * phase_error
    frequency_integral = p.resonance_hz + s.shift_hz
    current_proportional = 0.0
    if s.engaged == 0:
        s.current = p.kick * holding_current(setpoint, model)
    else:
        deviation = setpoint - amplitude
        share = decay_at(amplitude, model) / model.decay  # the zero follows the pole
        s.current += share * p.ki_mA_per_um_s * deviation * elapsed_s
        current_proportional = p.kp_mA_per_um * deviation
    s.asked = current_proportional + s.current
    s.asked_hz = frequency_proportional + frequency_integral
    state = (1.0 if responds else 0.0) + s.engaged
    return LoopTerms(current_proportional, s.current, frequency_proportional, frequency_integral, state)


def agc_pll_applied(s: Any, model: Any, level: float, frequency_hz: float) -> None:
    """Take back from both integrals what the limits did not let through (anti-windup), in place.

    Args:
        s: `AgcPllMemory`.
        model: fields of `rtctl.models.resonator.ResonatorParams`.
        level: the current that is applied [mA].
        frequency_hz: the frequency that is applied [Hz].
    """
    if level != s.asked and s.engaged != 0:
        s.current = holding_current(s.amplitude, model)
    if frequency_hz != s.asked_hz:
        s.shift_hz += frequency_hz - s.asked_hz


class AgcPllController:
    """The controller of current [mA] and frequency [Hz]; its setpoint is an amplitude [um]."""

    terms = TERMS
    preview_s = 0.0

    def __init__(self, model: ResonatorModel, tuning: AgcPllTuning, options: AgcPllOptions) -> None:
        self.tuning = tuning
        self.model = model.params
        self.params = AgcPllParams(
            float(tuning.kp_mA_per_um), float(tuning.ki_mA_per_um_s), float(tuning.kp_hz_per_deg),
            float(tuning.ki_hz_per_deg_s), float(options.phase_deg), float(options.gate), float(options.kick),
            model.resonance / (2.0 * math.pi),
        )  # fmt: skip
        self._memory = AgcPllMemory()

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start from rest: no current flows, so the frequency may start at the model's linear resonance."""
        self._memory = AgcPllMemory()

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Step both loops, or as many as the response allows; see `Controller`."""
        terms = agc_pll_step(
            self._memory, self.model, self.params, setpoint, estimate.value, estimate.surrogate, estimate.confidence,
            estimate.status, elapsed_s,
        )  # fmt: skip
        return ControlAction((self._memory.asked, self._memory.asked_hz), terms)

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from both integrals what the limits did not let through (anti-windup)."""
        agc_pll_applied(self._memory, self.model, levels[0], levels[1])
