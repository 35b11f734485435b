"""Gains of the amplitude and phase loops of a resonator, from its model and the delay of the loop.

Each open loop is K exp(-s tau) / s (see `agc_pll`). tau is what lies between a command and the reading that shows it:
half a sample period until the command acts on average, half a period of averaging in the lock-in, half a cycle because
only whole cycles count, and live one period more, because a reading is from before the command of its own exchange.
K <= 1 / (4 tau) leaves a phase margin of 76 deg and a gain margin of 6.3; the amplitude loop is `separation` times
slower, so that the phase loop follows the backbone while the amplitude moves along it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.models.resonator import ResonatorModel

MOST_BANDWIDTH = 0.25
"""Product K tau of the phase loop."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AgcPllTuning:
    """Gains of both loops, and their margins."""

    kp_mA_per_um: float
    ki_mA_per_um_s: float
    kp_hz_per_deg: float
    ki_hz_per_deg_s: float
    phase_bandwidth: float
    """Bandwidth of the PLL [rad/s]."""
    amplitude_bandwidth: float
    """Bandwidth of the AGC [rad/s]."""
    decay: float
    """Decay rate sigma of the resonator [1/s]."""
    delay_s: float
    """Delay tau of the loop [s]."""
    used: tuple[str, ...] = ()
    not_considered: tuple[str, ...] = ()

    def phase_margin_deg(self, bandwidth: float) -> float:
        """Return the phase margin of an integrator behind the delay [deg]."""
        return 90.0 - math.degrees(bandwidth * self.delay_s)

    def describe(self) -> str:
        """Return a sentence for a person."""
        uses = f"; the loop uses {', '.join(self.used)}" if self.used else ""
        left_out = f"; not considered: {', '.join(self.not_considered)}" if self.not_considered else ""
        return (
            f"PLL: {self.phase_bandwidth / (2.0 * math.pi):.1f} Hz wide (kp = {self.kp_hz_per_deg:.3g} Hz/deg, phase "
            f"margin {self.phase_margin_deg(self.phase_bandwidth):.0f} deg); AGC: "
            f"{self.amplitude_bandwidth / (2.0 * math.pi):.1f} Hz (kp = {self.kp_mA_per_um:.3g} mA/um); both zeros at "
            f"{self.decay:.0f} 1/s, delay {1e3 * self.delay_s:.2f} ms{uses}{left_out}"
        )


def loop_delay_s(period_s: float, delay: int, resonance: float) -> float:
    """Return the delay tau [s] of a sample period, `delay` periods of a late reading and a resonance [rad/s]."""
    return period_s * (1 + delay) + math.pi / resonance


def tune_agc_pll(
    model: ResonatorModel,
    *,
    period_s: float,
    delay: int,
    separation: float,
    phase_bandwidth: float | None = None,
    amplitude_bandwidth: float | None = None,
) -> AgcPllTuning:
    """Return gains for a model; bandwidths [rad/s] are chosen unless given. Raises ValueError for one too fast."""
    tau = (
        loop_delay_s(period_s, delay, model.resonance)
        + model.delay_s
        + model.drive_lag_s
        + model.sensor_lag_s
    )
    most = MOST_BANDWIDTH / tau
    phase = most if phase_bandwidth is None else phase_bandwidth
    amplitude = phase / separation if amplitude_bandwidth is None else amplitude_bandwidth
    for name, bandwidth in (("pll_bandwidth", phase), ("agc_bandwidth", amplitude)):
        if not 0.0 < bandwidth <= most * (1.0 + 1e-9):
            raise ValueError(
                f"controller.{name} = {bandwidth / (2.0 * math.pi):.4g} Hz must be > 0 and at most "
                f"{most / (2.0 * math.pi):.4g} Hz, a quarter of what the loop's delay of {1e3 * tau:.3g} ms allows; "
                "shorten the period or ask for less"
            )
    kp_a, kp_f = amplitude / model.growth, phase / 360.0
    return AgcPllTuning(
        kp_mA_per_um=kp_a,
        ki_mA_per_um_s=model.decay * kp_a,
        kp_hz_per_deg=kp_f,
        ki_hz_per_deg_s=model.decay * kp_f,
        phase_bandwidth=phase,
        amplitude_bandwidth=amplitude,
        decay=model.decay,
        delay_s=tau,
        used=model.used,
        not_considered=model.not_considered,
    )
