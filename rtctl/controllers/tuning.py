"""PI gains from the identified model, with their margins.

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
from numpy.typing import NDArray

from rtctl.controllers.pi import PiGains

SLOWEST = 1e-3  # loop gain g a sample: a crossover of 0.16 Hz at 1 ms


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Gains, and their margins at the steepest working point."""

    gains: PiGains
    gain_margin: float
    """Gain margin: factor by which the loop gain may rise."""
    phase_margin_deg: float
    crossover_hz: float
    plant_gain: float
    """Steepest slope of the model in use [um/mA]."""
    notes: tuple[str, ...] = ()
    """Mechanisms of an extended model that the loop uses."""
    sensitivity_peak: float = math.nan
    """Largest |1 / (1 + L)|, the reciprocal of the least distance from -1; NaN where it was not asked for."""
    kept_gains: bool = False
    """Gains that were tuned without the mechanisms are kept: the phase margin is less than was asked for."""

    def describe(self) -> str:
        """Return a sentence for a person."""
        uses = f"; the loop uses {', '.join(self.notes)}" if self.notes else ""
        if self.kept_gains:
            uses += (
                "; these gains were tuned without that and are kept, because slower ones would track worse and the "
                f"sensitivity's peak, {self.sensitivity_peak:.2f}, keeps the gain margin against changes of any phase"
            )
        return (
            f"PI: kp = {self.gains.kp:.4g} mA/um, ki = {self.gains.ki:.4g} mA/(um s); at the steepest slope, "
            f"{self.plant_gain:.0f} um/mA: gain margin {self.gain_margin:.2f}, phase margin "
            f"{self.phase_margin_deg:.0f} deg, crossover {self.crossover_hz:.3g} Hz{uses}"
        )


def loop_transfer(
    gains: PiGains, plant_gain: float, time_constant_s: float, period_s: float, delay: int
) -> Any:
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
    """Return gain and phase margin of given gains at the steepest working point."""
    loop = loop_transfer(gains, plant_gain, time_constant_s, period_s, delay)
    angle = np.concatenate((np.geomspace(1e-4, 0.3, 600), np.linspace(0.3, math.pi, 2000)[1:]))
    response = np.asarray(loop(np.exp(1j * angle)))
    gain_margin, phase_margin, crossover = margins_of(response, angle)
    return Tuning(
        gains=gains,
        gain_margin=gain_margin,
        phase_margin_deg=phase_margin,
        crossover_hz=crossover / (2.0 * math.pi * period_s),
        plant_gain=plant_gain,
    )


def margins_of(response: NDArray[np.complex128], angle: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return gain margin [factor], phase margin [deg] and crossover [rad a sample] of L(e^jw) on a grid up to Nyquist.

    Read off the response itself: `control.margin` solves polynomials, which fails where a zero cancels a pole, and
    leaves out a crossing at exactly half the sample rate. Infinite margins where there is no crossing; a loop whose
    gain is still above 1 at half the sample rate has its phase margin there.
    """
    size, phase = np.abs(response), np.unwrap(np.angle(response))
    falls = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    phase_margin, crossover = math.inf, 0.0
    if size[-1] >= 1.0:
        phase_margin, crossover = 180.0 + math.degrees(phase[-1]), float(angle[-1])
    for k in falls:
        share = (size[k] - 1.0) / (size[k] - size[k + 1])
        at = math.degrees(phase[k] + share * (phase[k + 1] - phase[k]))
        if 180.0 + at < phase_margin:
            phase_margin, crossover = 180.0 + at, float(angle[k] + share * (angle[k + 1] - angle[k]))
    below = phase + math.pi
    crossings = np.flatnonzero((below[:-1] > 0.0) & (below[1:] <= 1e-9))
    gain_margin = min((1.0 / float(size[k + 1]) for k in crossings), default=math.inf)
    return gain_margin, phase_margin, crossover


def tune(
    *,
    plant_gain: float,
    time_constant_s: float,
    period_s: float,
    delay: int,
    least_gain_margin: float,
    least_phase_margin_deg: float,
) -> Tuning:
    """Return the fastest PI that keeps both margins.

    With the heating pole cancelled the loop is an integrator of gain g behind d + 1 samples: phase margin `90 deg - (d
    + 1/2) w h` and gain margin follow from g alone, so g is found by bisection on both. If no gain keeps them (90 deg
    and more of phase) the slowest one is returned, whose margins show it. `plant_gain` [um/mA] is > 0, times are in s,
    `delay` in periods.
    """
    if not 0.0 < plant_gain < math.inf:
        raise ValueError(f"the steepest slope must be > 0 um/mA and finite to tune on, got {plant_gain!r}")
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

    def keeps(tuning: Tuning) -> bool:
        return tuning.gain_margin >= least_gain_margin and tuning.phase_margin_deg >= least_phase_margin_deg

    low, high = SLOWEST, 2.0
    for _ in range(24):
        middle = math.sqrt(low * high)
        if keeps(trial(middle)):
            low = middle
        else:
            high = middle
    return trial(low)
