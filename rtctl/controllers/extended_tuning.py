"""PI gains for an extended model: the most integral gain that keeps both margins, or the gains that the loop had.

With one time constant the zero cancels it (`tuning`). With more the zero is looked for: for each place of it the gain
is raised until a margin is met at the steepest slope, and the pair with the most integral gain is taken, which leaves
the least integrated error (K. J. Astrom, T. Hagglund, Advanced PID Control, section 6.8).

Margins are asked for because a model lacks something. What a diagnosis has named since is part of that, and has used up
its part of the phase margin in the loop that ran. So gains that were tuned without it are kept, where they are the
faster ones and the gain margin g that was asked for holds against changes of any phase: the peak of the sensitivity
|1 / (1 + L)| is at most g / (g - 1), which leaves a phase margin of 2 asin((g - 1) / (2 g)), 29 deg for g = 2 (the same
book, section 4.4).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rtctl.controllers.linear_loop import LinearLoop
from rtctl.controllers.pi import PiGains
from rtctl.controllers.tuning import Tuning, encloses, margins_of

ZEROS = 13
LEAST, MOST = 1e-5, 4.0
"""Range of kp ki's product with the plant's gain per sample in which the gain is sought."""
HALVINGS = 24


def extended_margins(
    gains: PiGains, loop: LinearLoop, *, plant_gain: float, period_s: float, delay: int
) -> Tuning:
    """Return the margins of given gains at the steepest working point, `plant_gain` [um/mA]; `delay` in periods."""
    return _margins(loop, plant_gain, period_s, delay)(gains)


def tune_extended(
    loop: LinearLoop,
    *,
    plant_gain: float,
    period_s: float,
    delay: int,
    least_gain_margin: float,
    least_phase_margin_deg: float,
    before: PiGains | None = None,
) -> Tuning:
    """Return the PI with the most integral gain that keeps both margins; if none does, the slowest one tried.

    `before` are gains that were tuned without what extends the model; they are returned where they have more integral
    gain and the sensitivity's peak allows it.
    """
    trial = _margins(loop, plant_gain, period_s, delay)

    def keeps(tuning: Tuning) -> bool:
        return tuning.gain_margin >= least_gain_margin and tuning.phase_margin_deg >= least_phase_margin_deg

    best: Tuning | None = None
    for zero_s in np.geomspace(*loop.slow_zero_candidates, ZEROS):
        low, high = LEAST, MOST
        for _ in range(HALVINGS):
            middle = math.sqrt(low * high)
            if keeps(trial(_gains(middle, float(zero_s), plant_gain, period_s))):
                low = middle
            else:
                high = middle
        tried = trial(_gains(low, float(zero_s), plant_gain, period_s))
        if best is None or (keeps(tried) and tried.gains.ki > best.gains.ki):
            best = tried
    assert best is not None
    kept = None if before is None else trial(before)
    if kept is not None and _is_better(kept, best, least_gain_margin):
        return replace(kept, kept_gains=True)
    return best


def _is_better(kept: Tuning, found: Tuning, least_gain_margin: float) -> bool:
    """Whether gains from before are faster, and robust enough to stay."""
    allowed = least_gain_margin / (least_gain_margin - 1.0) if least_gain_margin > 1.0 else math.inf
    stable = kept.phase_margin_deg > 0.0 and kept.gain_margin > 1.0
    return stable and kept.gains.ki > found.gains.ki and kept.sensitivity_peak <= allowed


def _gains(loop_gain: float, zero_s: float, plant_gain: float, period_s: float) -> PiGains:
    ki = loop_gain / (plant_gain * period_s)
    return PiGains(kp=max(ki * (zero_s - 0.5 * period_s), 0.0), ki=ki)


def _margins(loop: LinearLoop, plant_gain: float, period_s: float, delay: int) -> Callable[[PiGains], Tuning]:
    """Margins of any gains, with the plant's response computed once."""
    grids = [np.geomspace(1e-5, 0.3, 600), np.linspace(0.3, math.pi, 2000)[1:]]
    if loop.participation != 0.0:
        at = 2.0 * math.pi * loop.frequency_hz * period_s
        wide = at * (1.0 + np.linspace(-20.0, 20.0, 401) * loop.damping_ratio)
        grids.append(wide[(wide > 1e-5) & (wide < math.pi)])
    angle = np.unique(np.concatenate(grids))
    z = np.exp(1j * angle)
    plant = plant_gain * loop.response(angle, period_s) * z**-delay

    def of(gains: PiGains) -> Tuning:
        response = plant * ((gains.kp + gains.ki * period_s) - gains.kp / z) / (1.0 - 1.0 / z)
        gain_margin, phase_margin, crossover = margins_of(response, angle, stable=not encloses(response))
        return Tuning(
            gains=gains,
            gain_margin=gain_margin,
            phase_margin_deg=phase_margin,
            crossover_hz=crossover / (2.0 * math.pi * period_s),
            plant_gain=plant_gain,
            sensitivity_peak=float(1.0 / np.min(np.abs(1.0 + response))),
        )

    return of
