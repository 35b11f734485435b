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
    """Gain margin: factor by which the loop gain may rise; below 1 of a loop that is unstable, whose phase margin
    is negative."""
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
    gain_margin, phase_margin, crossover = margins_of(response, angle, stable=not encloses(response))
    return Tuning(
        gains=gains,
        gain_margin=gain_margin,
        phase_margin_deg=phase_margin,
        crossover_hz=crossover / (2.0 * math.pi * period_s),
        plant_gain=plant_gain,
    )


def margins_of(
    response: NDArray[np.complex128], angle: NDArray[np.float64], *, stable: bool
) -> tuple[float, float, float]:
    """Return gain margin [factor], phase margin [deg] and crossover [rad a sample] of L(e^jw) on a grid up to Nyquist.

    Read off the response itself: `control.margin` solves polynomials, which fails where a zero cancels a pole, and
    leaves out a crossing at exactly half the sample rate. Of all places where L crosses the negative real axis between
    -1 and 0 the one closest to -1 has the gain margin; of all places where |L| is 1 the one closest to -1 the phase
    margin, and is the crossover. A resonance behind a delay has several of both. Infinite where there are none: the
    crossover is then 0, or half the sample rate where |L| is above 1 up to there. How far -1 is does not say whether
    the loop is stable: that is given by `stable`. Of a loop that is not, the gain margin is the factor below 1 to which
    the gain must fall to be rid of all crossings beyond -1, and the phase margin is negative (-180 if |L| is never 1).
    """
    size = np.abs(response)
    k = np.flatnonzero((size[:-1] >= 1.0) != (size[1:] >= 1.0))
    share = (1.0 - size[k]) / (size[k + 1] - size[k])
    to_minus_one = np.degrees(np.abs(np.angle(-(response[k] + share * (response[k + 1] - response[k])))))
    nearest = int(np.argmin(to_minus_one)) if len(k) else -1
    phase_margin = float(to_minus_one[nearest]) if len(k) else math.inf
    if len(k):
        crossover = float(angle[k[nearest]] + share[nearest] * (angle[k[nearest] + 1] - angle[k[nearest]]))
    else:
        crossover = float(angle[-1]) if size[-1] >= 1.0 else 0.0
    real, imaginary = response.real, response.imag
    k = np.flatnonzero((imaginary[:-1] >= 0.0) != (imaginary[1:] >= 0.0))
    share = -imaginary[k] / (imaginary[k + 1] - imaginary[k])
    axis = np.append(real[k] + share * (real[k + 1] - real[k]), real[-1])  # at half the sample rate L is real
    axis = axis[(axis < 0.0) & ((axis > -1.0) if stable else (axis <= -1.0))]
    gain_margin = float(-1.0 / axis.min()) if len(axis) else math.inf if stable else 0.0
    return gain_margin, phase_margin if stable else -min(phase_margin, 180.0), crossover


def encloses(response: NDArray[np.complex128]) -> bool:
    """Return whether L(e^jw), on a grid from near 0 to Nyquist, encloses -1: the closed loop is unstable.

    Nyquist's criterion for a stable plant with at most one integrator in the loop: 1 + L begins within 90 deg of the
    positive real axis, is real at half the sample rate, and must have come back to the positive side without a turn.
    """
    turned = np.unwrap(np.angle(1.0 + response))
    return bool(abs(turned[-1]) > 0.5 * math.pi)


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
