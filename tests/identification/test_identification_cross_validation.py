"""The error on swings that took no part in a fit: near the noise of relays, far above it where the loops are none."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.identification.vo2.cross_validation import cross_validate, number_swings
from rtctl.identification.vo2.preisach_fit import fit_preisach

NOISE = 0.05


def oscillation(swings: int = 14, decay: float = 0.85) -> np.ndarray:
    """Levels [mA] up and down about 6 mA, each swing smaller, 25 levels each; the first sample resets the relays."""
    ends = [3.5, *(6.0 + 2.5 * (1 if k % 2 == 0 else -1) * decay**k for k in range(swings))]
    parts = [np.linspace(a, b, 25)[1:] for a, b in zip(ends, ends[1:], strict=False)]
    return np.concatenate([[0.0], *parts])


def relays(v: np.ndarray) -> np.ndarray:
    """Of a population of relays, 30 um in all."""
    draw = np.random.default_rng(5)
    centre, half = draw.normal(6.0, 0.6, 800), 0.5 * np.abs(draw.normal(0.7, 0.2, 800))
    on, found = np.zeros(800, bool), []
    for x in v:
        on = (x >= centre + half) | (on & (x > centre - half))
        found.append(30.0 * on.mean())
    return np.array(found)


def without_memory_of_loops(v: np.ndarray) -> np.ndarray:
    """Loops that depend on how far the last reversal is away, and forget all before: no sum of relays."""
    found, reversal, rising = [], v[0], True
    for before, x in zip(np.append(v[0], v[:-1]), v, strict=True):
        if x != before and (x > before) != rising:
            reversal, rising = before, x > before
        away = x - reversal
        found.append(30.0 / (1.0 + np.exp(-3.0 * (x - 6.0 - 0.35 * np.tanh(2.0 * away)))))
    return np.array(found)


def test_swings_are_numbered_from_reversal_to_reversal_and_noise_makes_none() -> None:
    v = np.array([0.0, 1.0, 2.0, 1.99, 3.0, 2.0, 1.0, 1.01, 0.5, 2.0])
    assert number_swings(v, 0.05).tolist() == [0, 0, 0, 0, 0, 1, 1, 1, 1, 2]


def test_loops_of_relays_are_predicted_almost_to_the_noise() -> None:
    v = oscillation()
    scored = v > 0.0
    y = relays(v) + NOISE * np.random.default_rng(1).normal(size=len(v))
    error = cross_validate(v, y, scored)
    assert error is not None
    assert NOISE < error < 6.0 * NOISE


def test_loops_that_are_no_sum_of_relays_are_predicted_far_worse_than_they_are_fitted() -> None:
    v = oscillation()
    scored = v > 0.0
    noise = NOISE * np.random.default_rng(1).normal(size=len(v))
    of_relays, others = (cross_validate(v, of(v) + noise, scored) for of in (relays, without_memory_of_loops))
    assert of_relays is not None
    assert others is not None
    assert others > 3.0 * of_relays


def test_a_swing_is_predicted_by_loops_that_did_not_see_it() -> None:
    """Swings 1 to 12 are inner ones; every third is left out in turn, and its own readings change no prediction."""
    v = oscillation()
    scored, swing = v > 0.0, number_swings(v, 0.1)
    y = relays(v) + NOISE * np.random.default_rng(1).normal(size=len(v))
    inner = [k for k in range(swing.max() + 1) if np.ptp(v[scored & (swing == k)]) < 0.8 * np.ptp(v[scored])]
    squares, count = 0.0, 0
    for part in range(3):
        unseen = scored & np.isin(swing, inner[part::3])
        spoilt = np.where(unseen, 1e3, y)
        predicted = fit_preisach(v, spoilt, scored & ~unseen, cells=24).model.simulate(v)
        squares += float(np.sum((predicted - y)[unseen] ** 2))
        count += int(unseen.sum())
    assert cross_validate(v, y, scored) == pytest.approx(np.sqrt(squares / count), rel=1e-9)


@pytest.mark.parametrize("swings", [1, 3])
def test_too_few_swings_predict_nothing(swings: int) -> None:
    v = oscillation(swings)
    assert cross_validate(v, relays(v), v > 0.0) is None
