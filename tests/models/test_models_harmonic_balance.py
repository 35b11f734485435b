"""Backbones by harmonic balance against the exact period of the Duffing oscillator, and against integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from rtctl.models.harmonic_balance import HARMONICS, backbone


def exact_frequency_hz(peak: float, k: float, k3: float) -> float:
    """T = 4 K(m) / sqrt(k + k3 A^2), m = k3 A^2 / 2 (k + k3 A^2), A the largest displacement."""
    stiffened = k + k3 * peak**2
    return math.sqrt(stiffened) / (4.0 * ellipk(0.5 * k3 * peak**2 / stiffened))


@pytest.mark.parametrize("k3", [0.01, 0.5, 3.0, -0.05, -0.4])
@pytest.mark.parametrize("amplitude", [0.1, 0.7, 1.0])
def test_it_is_the_exact_duffing_period(k3: float, amplitude: float) -> None:
    found = backbone(amplitude, stiffness=1.0, cubic=k3)
    assert found.converged
    peak = float(found.coefficients.sum())  # every cosine is 1 at the turning point
    assert found.frequency_hz == pytest.approx(exact_frequency_hz(peak, 1.0, k3), rel=2e-6)


def test_newtons_method_has_the_right_jacobian() -> None:
    """With it every iteration doubles the digits; with a wrong one it would crawl."""
    found = backbone(1.0, stiffness=1.0, cubic=2.0, quintic=5.0)
    assert found.converged
    assert found.iterations <= 7


def test_more_harmonics_come_closer() -> None:
    errors = []
    for count in (1, 2, 3, 4, 5):
        found = backbone(1.0, stiffness=1.0, cubic=3.0, harmonics=HARMONICS[:count])
        exact = exact_frequency_hz(float(found.coefficients.sum()), 1.0, 3.0)
        errors.append(abs(found.frequency_hz / exact - 1.0))
    assert errors[0] > 1e-3
    assert all(after < 0.2 * before for before, after in zip(errors, errors[1:], strict=False))


def test_a_quintic_term_against_scipy() -> None:
    found = backbone(0.8, stiffness=1.0, cubic=-0.6, quintic=0.9)
    peak = float(found.coefficients.sum())

    def slope(t, y):
        return [y[1], -y[0] * (1.0 - 0.6 * y[0] ** 2 + 0.9 * y[0] ** 4)]

    def upwards(t, y):
        return y[1]

    upwards.direction = -1.0  # type: ignore[attr-defined]
    run = solve_ivp(slope, (0.0, 100.0), [peak, 0.0], rtol=1e-11, atol=1e-12, events=upwards, method="DOP853")
    periods = np.diff(run.t_events[0])
    assert found.frequency_hz == pytest.approx(1.0 / periods.mean(), rel=1e-7)


def test_at_no_amplitude_it_is_the_linear_resonance() -> None:
    assert backbone(0.0, stiffness=(2.0 * math.pi * 7500.0) ** 2, cubic=1e7).frequency_hz == 7500.0
    small = backbone(1e-6, stiffness=4.0, cubic=1e3, quintic=1e3)
    assert small.frequency_hz == pytest.approx(2.0 / (2.0 * math.pi), rel=1e-9)


@pytest.mark.parametrize("stiffness", [0.0, -4275.6, math.nan])
def test_without_a_linear_stiffness_there_is_no_backbone_from_rest(stiffness: float) -> None:
    with pytest.raises(ValueError, match="stiffness must be > 0"):
        backbone(1.0, stiffness=stiffness, cubic=88.2)


def test_where_no_free_vibration_exists_it_says_so() -> None:
    """Beyond A = 1 / sqrt(-k3) the force no longer restores."""
    found = backbone(3.0, stiffness=1.0, cubic=-1.0)
    assert not found.converged or not math.isfinite(found.frequency_hz)
