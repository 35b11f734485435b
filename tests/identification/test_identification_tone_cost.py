"""The fused objective: its motion is SciPy's, its scores are those of the whole trajectory, its symmetry is exact."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rtctl.identification.oscillator.tone_cost import (
    LANES,
    Objective,
    ToneRecord,
    compute_cost,
    compute_scores,
    simulate_tone,
)

PERIOD_S = 1.0 / 125e3
RESONANCE = 2.0 * math.pi * 7500.0
DUFFING = np.array([RESONANCE / 200.0, RESONANCE**2, -8e6, RESONANCE**2 / 400.0, RESONANCE * 0.999])
"""Of quality 200, 0.5 um in resonance."""


def record(samples: int = 2500, *, values: np.ndarray = DUFFING, **more: object) -> ToneRecord:
    empty = ToneRecord(displacement=np.zeros(samples), period_s=PERIOD_S, **more)  # type: ignore[arg-type]
    return ToneRecord(displacement=simulate_tone(empty, values), period_s=PERIOD_S, **more)  # type: ignore[arg-type]


def by_scipy(values: np.ndarray, samples: int, start: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    c, k, b, force, w = values
    found = solve_ivp(
        lambda t, y: [y[1], force * math.cos(w * t) - c * y[1] - k * y[0] - b * y[0] ** 3],
        (0.0, PERIOD_S * samples),
        start,
        method="DOP853",
        t_eval=PERIOD_S * np.arange(samples),
        rtol=1e-11,
        atol=1e-13,
    )
    return np.asarray(found.y[0])


def test_a_linear_oscillator_is_exact_and_a_duffing_oscillator_as_good_as_splitting_promises():
    linear = DUFFING * np.array([1.0, 1.0, 0.0, 1.0, 1.0])
    for values, bound in ((linear, 1e-9), (DUFFING, 5e-5)):
        exact = by_scipy(values, 1500)
        off = np.abs(simulate_tone(record(1500), values) - exact).max() / np.abs(exact).max()
        assert off < bound


def test_a_motion_starts_where_the_record_says():
    made = record(300, start=(0.3, -2000.0)).displacement
    assert np.abs(made - by_scipy(DUFFING, 300, (0.3, -2000.0))).max() < 5e-5 * 0.3


def test_scores_are_those_of_the_whole_trajectories_in_every_lane():
    rng = np.random.default_rng(3)
    sets = DUFFING * (1.0 + 2e-3 * rng.standard_normal((LANES + 3, 5)))
    measured = record(first=700)
    found = compute_scores(measured, sets)
    m = measured.displacement[700:]
    for lane in (0, 1, LANES - 1, LANES, LANES + 2):
        z = simulate_tone(measured, sets[lane])[700:]
        assert found.correlation[lane] == pytest.approx(np.corrcoef(z, m)[0, 1], rel=1e-10)
        assert found.rms[lane] == pytest.approx(np.sqrt(np.mean((z - m) ** 2) / np.mean(m**2)), rel=1e-8)
        assert found.peak_to_peak[lane] == pytest.approx(np.ptp(z - m) / np.ptp(m), rel=1e-10)


def test_peak_indices_are_matched_as_a_plain_search_does():
    measured = record(first=500)
    other = DUFFING * np.array([1.5, 1.004, 1.0, 1.0, 1.0])
    z, peaks = simulate_tone(measured, other), measured.peaks
    mismatch = []
    ends = [(a + b) // 2 + 1 for a, b in pairwise(peaks)]
    for peak, (begin, end) in zip(peaks[1:-1], pairwise(ends), strict=True):
        where = begin + int(np.argmax(z[begin:end]))
        mismatch.append(min(abs(where - peak) * 2.0 / (end - begin), 1.0))
    found = compute_cost(measured, Objective.PEAK_INDEX, np.vstack((DUFFING, other)))
    assert found[0] == 0.0
    assert found[1] == pytest.approx(np.mean(mismatch), rel=1e-12)
    assert found[1] > 0.05


def test_correlation_and_peak_index_do_not_see_a_motion_scaled_with_force_and_cubic_stiffness():
    scaled = DUFFING * np.array([1.0, 1.0, 1.7**-2, 1.7, 1.0])
    sets = np.vstack((DUFFING, scaled))
    for objective in (Objective.CORRELATION, Objective.PEAK_INDEX):
        assert compute_cost(record(), objective, sets) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert compute_cost(record(), Objective.RMS, sets)[1] == pytest.approx(0.7, rel=1e-6)


def test_what_is_no_underdamped_oscillator_has_an_infinite_cost():
    overdamped = DUFFING * np.array([1.0, 1.0, 1.0, 1.0, 1.0])
    overdamped[0] = 2.1 * RESONANCE
    for objective in (Objective.RMS, Objective.PEAK_TO_PEAK, Objective.PEAK_INDEX):
        assert math.isinf(compute_cost(record(), objective, overdamped[None, :])[0])


def test_too_few_samples_a_period_are_refused_with_the_limit():
    slow = ToneRecord(displacement=np.ones(100), period_s=1.0 / 60e3)
    with pytest.raises(ValueError, match="12 samples a period at 60000 Hz"):
        compute_scores(slow, DUFFING[None, :])
