"""PI gains from the identified model, with the margins that they leave.

The loop sees the heating as `G(z)`, the zero-order-hold equivalent of `K / (tau s + 1)` behind a delay of whole
periods. The controller's zero cancels the heating pole, so the open loop is `K kp (1 - a) / (a (z - 1)) z^-d` with
`a = exp(-h / tau)`; K is the steepest slope of the identified deflection against current, so every other working
point is slower but no less stable. The gain is the largest that keeps both margins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.controllers.pi import PiGains


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Gains and what they leave at the steepest working point."""

    gains: PiGains
    gain_margin: float
    """Factor by which the loop gain may rise."""
    phase_margin_deg: float
    crossover_hz: float
    plant_gain: float
    """Steepest slope used [um/mA]."""


def loop_transfer(gains: PiGains, plant_gain: float, time_constant_s: float, period_s: float, delay: int) -> Any:
    """Open loop L(z) as a python-control transfer function: PI, delay, heating through a zero-order hold."""
    import control

    heating = control.tf([plant_gain], [time_constant_s, 1.0])
    sampled = control.sample_system(heating, period_s, method="zoh")
    controller = control.tf([gains.kp + gains.ki * period_s, -gains.kp], [1.0, -1.0], period_s)
    wire = control.tf([1.0], [1.0] + [0.0] * delay, period_s)
    return controller * wire * sampled


def margins(
    gains: PiGains, *, plant_gain: float, time_constant_s: float, period_s: float, delay: int
) -> Tuning:
    """Gain and phase margin of given gains at the steepest working point."""
    import control

    loop = loop_transfer(gains, plant_gain, time_constant_s, period_s, delay)
    gain_margin, phase_margin, _, crossover = control.margin(loop)
    at_nyquist = float(np.real(loop(-1.0)))  # control.margin leaves out a crossing at exactly half the sample rate
    if at_nyquist < 0.0:
        gain_margin = min(gain_margin, -1.0 / at_nyquist)
    hertz = float(crossover) / (2.0 * math.pi) if np.isfinite(crossover) else 0.0
    return Tuning(
        gains=gains,
        gain_margin=float(gain_margin),
        phase_margin_deg=float(phase_margin),
        crossover_hz=hertz,
        plant_gain=plant_gain,
    )


def tune(
    *,
    plant_gain: float,
    time_constant_s: float,
    period_s: float,
    delay: int,
    least_gain_margin: float,
    least_phase_margin_deg: float,
) -> Tuning:
    """The fastest PI that keeps both margins. `plant_gain` [um/mA] > 0, times in s, `delay` in periods.

    With the heating pole cancelled the loop is an integrator of gain g behind d + 1 samples: phase margin
    `90 deg - (d + 1/2) w h` and gain margin follow from g alone, so g is found by bisection on both.
    """
    if not plant_gain > 0.0:
        raise ValueError(f"the steepest slope must be > 0 um/mA to tune on, got {plant_gain!r}")
    decay = math.exp(-period_s / time_constant_s)

    def trial(g: float) -> Tuning:
        kp = g * decay / (plant_gain * (1.0 - decay))
        ki = g / (plant_gain * period_s)
        return margins(
            PiGains(kp=kp, ki=ki),
            plant_gain=plant_gain,
            time_constant_s=time_constant_s,
            period_s=period_s,
            delay=delay,
        )

    low, high = 1e-3, 2.0
    for _ in range(24):
        middle = math.sqrt(low * high)
        result = trial(middle)
        if result.gain_margin >= least_gain_margin and result.phase_margin_deg >= least_phase_margin_deg:
            low = middle
        else:
            high = middle
    return trial(low)
