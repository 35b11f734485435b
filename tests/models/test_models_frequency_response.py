"""Forced response: the linear formula, the one-harmonic Duffing cubic, the backbone, Liouville's theorem, folds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rtctl.models.frequency_response import (
    HARMONICS,
    SAMPLES,
    OddOscillator,
    cycle,
    frequency_response,
    multipliers,
)
from rtctl.models.harmonic_balance import backbone

RESONANCE = 2.0 * math.pi * 7500.0
LINEAR = OddOscillator(damping=RESONANCE / 500.0, stiffness=RESONANCE**2)
SOFTENING = OddOscillator(damping=RESONANCE / 500.0, stiffness=RESONANCE**2, cubic=-1e7)
BOTH = OddOscillator(damping=RESONANCE / 500.0, stiffness=RESONANCE**2, cubic=-6.3e6, quintic=5.7e5)
FORCE = RESONANCE**2 / 500.0
"""um/s^2: 1 um in the linear resonance."""
LOW, HIGH = 2.0 * math.pi * 7350.0, 2.0 * math.pi * 7650.0


def test_a_linear_oscillator_has_its_transfer_function_at_every_harmonic_of_the_force():
    force = FORCE * (np.cos(cycle()) + 0.3 * np.sin(3.0 * cycle()))
    found = frequency_response(LINEAR, force, LOW, HIGH)
    w = found.rate
    for n, drive in ((1, 1.0), (3, -0.3j)):
        exact = FORCE * drive / (LINEAR.stiffness - (n * w) ** 2 + 1j * n * w * LINEAR.damping)
        assert np.abs(found.phasors[:, HARMONICS.index(n)] - exact).max() < 1e-9 * np.abs(exact).max()
    assert found.stable.all()
    assert len(found.folds) == 0
    assert w[0] == pytest.approx(LOW, rel=1e-12)
    assert w[-1] >= HIGH


def test_with_one_harmonic_every_point_solves_the_duffing_cubic():
    found = frequency_response(SOFTENING, 1.5 * FORCE * np.cos(cycle()), LOW, HIGH, harmonics=(1,))
    a, w = found.amplitude, found.rate
    detuning = SOFTENING.stiffness + 0.75 * SOFTENING.cubic * a**2 - w**2
    force = a * np.hypot(detuning, SOFTENING.damping * w)
    assert np.abs(force / (1.5 * FORCE) - 1.0).max() < 1e-9
    assert len(found.folds) == 2


def test_the_peak_lies_on_the_backbone():
    for oscillator, size in ((SOFTENING, 1.5), (BOTH, 5.0)):
        found = frequency_response(oscillator, size * FORCE * np.cos(cycle()), LOW, HIGH + 2000.0)
        rate, amplitude = found.peak
        free = backbone(
            amplitude, stiffness=oscillator.stiffness, cubic=oscillator.cubic, quintic=oscillator.quintic
        )
        assert rate == pytest.approx(2.0 * math.pi * free.frequency_hz, abs=0.02 * oscillator.damping)


def test_multipliers_multiply_to_the_loss_of_area():
    found = frequency_response(BOTH, 5.0 * FORCE * np.cos(cycle()), LOW, HIGH + 2000.0)
    first, second = multipliers(BOTH, found.rate, found.phasors)
    expected = np.exp(-2.0 * math.pi * BOTH.damping / found.rate)
    assert np.abs(first * second / expected - 1.0).max() < 1e-12


def test_stability_changes_at_the_folds_and_nowhere_else():
    for size in (1.5, 5.0):
        found = frequency_response(BOTH, size * FORCE * np.cos(cycle()), LOW, HIGH + 2000.0)
        changes = np.flatnonzero(np.diff(found.stable.astype(int)))
        assert len(found.folds) == len(changes) > 0
        assert np.abs(changes - found.folds).max() <= 2


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match="damping must be > 0"):
        OddOscillator(damping=0.0, stiffness=1.0)
    with pytest.raises(ValueError, match=f"force must have {SAMPLES} samples"):
        frequency_response(LINEAR, np.zeros(7), LOW, HIGH)
    with pytest.raises(ValueError, match="0 < low_rate < high_rate"):
        frequency_response(LINEAR, np.zeros(SAMPLES), HIGH, LOW)
