"""Annealing finds a valley's floor; the paper's letter climbs out of it; the best is never lost."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.identification.oscillator.annealing import AnnealingOptions, anneal, anneal_as_printed

LOW, HIGH = np.full(4, -1.0), np.full(4, 1.0)
FLOOR = np.array([0.31, -0.22, 0.4, -0.5])
SKEW = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 4)))[0] * np.array([1.0, 0.1, 0.01, 0.003])
START = np.array([-0.5, 0.5, -0.2, 0.6])


def valley(sets: np.ndarray) -> np.ndarray:
    """A narrow bowl, 300 times as long as wide and along no axis, with ripples on its walls."""
    along = (sets - FLOOR) @ np.linalg.inv(SKEW)
    size = np.sqrt(np.sum((along / 300.0) ** 2, axis=1))
    return size + 0.02 * size * np.cos(40.0 * size)


def test_a_narrow_skew_valley_is_followed_to_its_floor():
    for seed in range(3):
        found = anneal(valley, START, LOW, HIGH, AnnealingOptions(seed=seed))
        assert found.cost < 1e-6
        assert found.values == pytest.approx(FLOOR, abs=1e-4)
        assert found.evaluations == 1 + 30 * 305


def test_the_best_is_kept_though_worse_moves_are_taken():
    found = anneal(valley, START, LOW, HIGH, AnnealingOptions(temperatures=40, cooling=0.999))
    assert (np.diff(found.best) <= 0.0).all()
    assert found.cost == found.best[-1] == pytest.approx(valley(found.values[None, :])[0])


def test_a_minimum_on_a_bound_is_reached_and_no_move_leaves_the_box():
    seen = []

    def noted(sets: np.ndarray) -> np.ndarray:
        seen.append(sets)
        return np.sum(sets, axis=1)

    found = anneal(noted, START, LOW, HIGH, AnnealingOptions(temperatures=150))
    every = np.vstack(seen)
    assert (every >= LOW).all()
    assert (every <= HIGH).all()
    assert found.cost == pytest.approx(-4.0, abs=0.01)


def test_the_letter_drives_an_error_up_and_takes_no_worse_move_of_a_correlation():
    few = AnnealingOptions(temperatures=20)
    error = anneal_as_printed(valley, START, LOW, HIGH, few)
    assert error.cost > valley(START[None, :])[0]
    merit = anneal_as_printed(lambda sets: -valley(sets), START, LOW, HIGH, few)
    assert (np.diff(merit.best) >= 0.0).all()
    assert merit.cost > -valley(START[None, :])[0]


def test_the_same_seed_gives_the_same_moves():
    first, again = (anneal(valley, START, LOW, HIGH, AnnealingOptions(seed=5)) for _ in range(2))
    assert (first.values == again.values).all()


def test_bad_starts_and_options_are_refused():
    with pytest.raises(ValueError, match="a start between them"):
        anneal(valley, 2.0 * HIGH, LOW, HIGH)
    with pytest.raises(ValueError, match="start where the model runs"):
        anneal(lambda sets: np.full(len(sets), np.inf), START, LOW, HIGH)
    with pytest.raises(ValueError, match=r"cooling must lie in \(0, 1\), got 1.5"):
        AnnealingOptions(cooling=1.5)
