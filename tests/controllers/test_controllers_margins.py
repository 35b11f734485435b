"""Margins against the poles of the closed loop, where a resonance behind a delay crosses the axis several times."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest

from rtctl.controllers.tuning import encloses, margins_of

PERIOD_S = 1e-3
ANGLE = np.unique(np.concatenate([np.geomspace(1e-5, 0.3, 4000), np.linspace(0.3, np.pi, 8000)]))
"""Fine about every resonance below."""


def loop(gain: float, mode_hz: float, share: float, delay: int) -> Any:
    """An integrator, a swing of 2 % damping beside it, and whole periods of delay."""
    rate = 2.0 * np.pi * mode_hz
    swing = control.tf([rate**2], [1.0, 0.04 * rate, rate**2])
    plant = control.sample_system((1.0 - share) + share * swing, PERIOD_S, method="zoh")
    integral = control.tf([gain, 0.0], [1.0, -1.0], PERIOD_S)
    return integral * plant * control.tf([1.0], [1.0] + [0.0] * delay, PERIOD_S)


def is_stable(system: Any) -> bool:
    return bool(np.abs(control.feedback(system, 1).poles()).max() < 1.0)


CASES = [
    (gain, mode_hz, share, delay)
    for gain in (0.01, 0.05, 0.2)
    for mode_hz in (30.0, 60.0, 150.0)
    for share in (0.1, 0.5)
    for delay in (1, 4, 7)
]


@pytest.mark.parametrize(("gain", "mode_hz", "share", "delay"), CASES)
def test_stability_and_gain_margin_are_those_of_the_poles(
    gain: float, mode_hz: float, share: float, delay: int
) -> None:
    system = loop(gain, mode_hz, share, delay)
    response = np.asarray(system(np.exp(1j * ANGLE)))
    stable = not encloses(response)
    assert stable == is_stable(system)
    gain_margin, phase_margin, _ = margins_of(response, ANGLE, stable=stable)
    assert (gain_margin > 1.0) == (phase_margin > 0.0) == stable
    assert is_stable(0.99 * gain_margin * system)
    assert not is_stable(1.01 * gain_margin * system)


def test_a_loop_that_is_unstable_at_every_phase_says_so_in_a_number() -> None:
    response = np.asarray(loop(100.0, 60.0, 0.1, 4)(np.exp(1j * ANGLE)))
    assert encloses(response)
    gain_margin, phase_margin, crossover = margins_of(response, ANGLE, stable=False)
    assert 0.0 < gain_margin < 0.01
    assert phase_margin == -180.0
    assert crossover == pytest.approx(np.pi)


@pytest.mark.parametrize(("gain", "mode_hz", "share", "delay"), CASES)
def test_a_turn_by_the_phase_margin_reaches_the_brink(
    gain: float, mode_hz: float, share: float, delay: int
) -> None:
    """Turned by the margin to one side or the other L goes through -1, and no place where |L| is 1 is nearer."""
    response = np.asarray(loop(gain, mode_hz, share, delay)(np.exp(1j * ANGLE)))
    _, phase_margin, crossover = margins_of(response, ANGLE, stable=not encloses(response))

    def nearest(turn_deg: float) -> float:
        turned = (response * np.exp(1j * np.radians(side * turn_deg)) for side in (-1.0, 1.0))
        return float(min(np.abs(1.0 + one).min() for one in turned))

    assert nearest(abs(phase_margin)) < 0.02
    of_size_one = response[np.abs(np.abs(response) - 1.0) < 0.05]
    assert np.degrees(np.abs(np.angle(-of_size_one))).min() > abs(phase_margin) - 6.0
    assert 0.0 < crossover < np.pi
