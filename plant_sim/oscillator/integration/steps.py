"""The number of integration steps in a sample at which the integrator is not the error, and the method.

RK4 loses (w h)^6 / 72 of an oscillation's energy a step (Hairer, Norsett, Wanner II), so over 1,000 periods 2 pi 1000
(w h)^5 / 72; 256 steps a period keep that below 1e-6.

A splitting loses nothing: its energy swings by less than 0.4 share (w h)^2, where the share is that of the nonlinear
force in the linear one at the farthest point (measured: 0.26 of a cubic, 0.33 of a quadratic, 0.25 of a quintic force,
a twentieth more at 12 steps a period), and its frequency is off by less than 0.1 share^2 (w h)^2. So sqrt(0.4 share /
1e-6) steps a radian keep the energy within 1e-6, for however many periods. Below 12 steps a period kicks would fall in
step with the motion (z^3 at 2 and 4 a period, z^5 at 6). A linear oscillator is not kicked.
"""

from __future__ import annotations

import math
from typing import NamedTuple

STEPS_PER_PERIOD = 256.0
LARGEST_DAMPING_STEP = 0.5
"""Largest product of damping and step: RK4 is stable to 2.78, and accurate to 1e-3 here."""
MOST_SUBSTEPS = 100_000
MOST_STEPS = 40_000_000
"""Most steps of one record: 24 bytes each for the drive alone."""
ENERGY_SWING = 1e-6
SWING_COEFFICIENT = 0.4
LEAST_KICKS = 12.0
"""Least kicks in a period."""
SPLITTING_COST = 0.6
"""Cost of a step of a splitting, in RK4's: measured 0.3 of one trajectory, 0.65 of many lanes."""
SMOOTH_DRIVE_STEPS = 64.0
"""Steps in a period of the pole at which parabolas match a drive that is neither held nor linear, to 1e-5."""


class Plan(NamedTuple):
    """How to integrate a record."""

    substeps: int
    splitting: bool


def plan(
    period_s: float,
    rate: float,
    damping: float,
    share: float,
    *,
    parabolic: bool,
    steps_per_period: float | None,
) -> Plan:
    """Return the cheaper method and its steps between two samples.

    Args:
        period_s: sample period [s].
        rate: fastest angular frequency [1/s].
        damping: largest damping [1/s].
        share: share of the nonlinear force in the linear one, infinite if there is more than a force of position.
        parabolic: whether the drive is a parabola between any two instants.
        steps_per_period: RK4 steps in a period of the fastest pole; None: chosen.

    Raises:
        ValueError: no sensible step resolves the model.
    """
    by_rk4 = substeps(period_s, rate, damping, steps_per_period or STEPS_PER_PERIOD)
    if steps_per_period is None and share < math.inf:
        periods = period_s * rate / (2.0 * math.pi)
        by_splitting = max(1.0, periods * splitting_steps(share, parabolic=parabolic))
        if SPLITTING_COST * by_splitting < by_rk4:
            return Plan(math.ceil(by_splitting - 1e-9), True)
    return Plan(by_rk4, False)


def check_work(substeps: int, samples: int) -> None:
    """Raise ValueError where a record's steps would fill the memory: a parameter is absurd, then."""
    if substeps * samples > MOST_STEPS:
        raise ValueError(
            f"{samples} samples of {substeps} steps each, as the model's fastest pole needs, are more than a record "
            f"may take ({MOST_STEPS:.0e}); check the units of its parameters"
        )


def splitting_steps(share: float, *, parabolic: bool) -> float:
    """Return the steps in a period of the fastest pole that a splitting needs."""
    wanted = 0.0 if parabolic else SMOOTH_DRIVE_STEPS
    if share > 0.0:
        wanted = max(wanted, LEAST_KICKS, 2.0 * math.pi * math.sqrt(SWING_COEFFICIENT * share / ENERGY_SWING))
    return wanted


def substeps(period_s: float, rate: float, damping: float, steps_per_period: float = STEPS_PER_PERIOD) -> int:
    """Return the steps between two samples for the fastest pole.

    Args:
        period_s: sample period [s].
        rate: angular frequency of the pole [rad/s].
        damping: its damping [1/s].
        steps_per_period: steps in a period of the pole.

    Raises:
        ValueError: the steps are beyond reason; a parameter's unit is wrong then.
    """
    wanted = period_s * max(rate * steps_per_period / (2.0 * math.pi), damping / LARGEST_DAMPING_STEP)
    if not wanted <= MOST_SUBSTEPS:
        raise ValueError(
            f"the model's fastest pole, {rate:.3g} rad/s with damping {damping:.3g} 1/s, would need {wanted:.3g} "
            f"steps between two samples {period_s:.3g} s apart (at most {MOST_SUBSTEPS}); check the units of its "
            "parameters"
        )
    return max(1, math.ceil(wanted - 1e-9))
