"""Lags and modes under polynomials of time: exact from steps of a millionth of a time constant to a million."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp

from plant_sim.oscillator.integration.linear import PARABOLA, SERIES_BELOW, lag, lagging_nodes, mode_response

FloatArray = NDArray[np.float64]


@pytest.mark.parametrize("steps", [1e-6, 0.03, 1.0, SERIES_BELOW * 0.999, SERIES_BELOW, 30.0, 1e6])
def test_a_lag_of_a_power_is_its_convolution(steps: float) -> None:
    made = lag(steps, 3)
    for k in range(4):

        def follower(s: float, k: int = k) -> float:
            longest = min(steps * s, 50.0)  # exp(-50) of the rest
            return quad(lambda x: math.exp(-x) * max(s - x / steps, 0.0) ** k, 0.0, longest, epsabs=1e-14)[0]

        assert made.end[k] == pytest.approx(follower(1.0), rel=1e-11)
        if 0.01 < steps < 100.0:
            moments = [quad(lambda s, j=j: s**j * follower(s), 0.0, 1.0, epsabs=1e-13)[0] for j in range(3)]
            assert made.moments[k] == pytest.approx(moments, rel=1e-10)


def test_closed_form_and_series_meet() -> None:
    below, above = lag(SERIES_BELOW * (1.0 - 1e-15), 3), lag(SERIES_BELOW, 3)
    assert below.end == pytest.approx(above.end, rel=1e-13)
    assert below.moments == pytest.approx(above.moments, rel=1e-13)


@pytest.mark.parametrize("steps", [1e-4, 0.1, 2.0, 10.0, 1e5])
def test_a_lagging_drive_has_each_steps_impulse_and_its_first_moment(steps: float) -> None:
    rng = np.random.default_rng(2)
    nodes = rng.standard_normal((40, 3))  # jumps at every step
    behind = lagging_nodes(nodes, steps)
    state = nodes[0, 0]
    for u, x in zip(nodes, behind, strict=True):
        a, b, c = PARABOLA @ u
        # x' = steps (u - x): the mean of x is that of u less what the state gained; s x likewise, by parts
        made = lag(steps, 2).end @ np.array([a, b, c])
        end = state * math.exp(-steps) + made
        mean = u @ [1.0, 4.0, 1.0] / 6.0 - (end - state) / steps
        assert x @ [1.0, 4.0, 1.0] / 6.0 == pytest.approx(mean, abs=2e-14 / min(steps, 1.0))
        first_of_u = a / 2.0 + b / 3.0 + c / 4.0
        a, b, c = PARABOLA @ x
        assert a / 2.0 + b / 3.0 + c / 4.0 == pytest.approx(
            first_of_u - (end - mean) / steps, abs=1e-13 / min(steps, 1.0) ** 2
        )
        state = end


def test_a_lag_that_vanishes_leaves_the_drive_jumps_included() -> None:
    nodes = np.random.default_rng(3).standard_normal((100, 3))
    assert np.abs(lagging_nodes(nodes, 1e15) - nodes).max() < 1e-12
    slower = [np.abs(lagging_nodes(nodes, steps) - nodes).max() for steps in (1e3, 1e4)]
    assert slower[0] / slower[1] == pytest.approx(10.0, rel=0.02)  # of first order in the time constant


def test_a_constant_drive_passes_a_lag_unchanged() -> None:
    for steps in (1e-5, 0.3, 7.0, 1e4):
        assert lagging_nodes(np.full((50, 3), 1.7), steps) == pytest.approx(1.7, rel=1e-13)


@pytest.mark.parametrize("settled", [0.0, 0.4])
def test_a_lag_may_begin_below_the_first_value(settled: float) -> None:
    """As one that had followed a smaller drive until then."""
    drive = np.random.default_rng(3).normal(size=(40, 3)) + 2.0
    before = np.full((200, 3), settled * drive[0, 0])
    long = lagging_nodes(np.concatenate((before, drive)), 0.3)[200:]
    assert lagging_nodes(drive, 0.3, settled) == pytest.approx(long, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.01, 0.5, 1.0, 3.0], ids=lambda ratio: f"ratio={ratio}")
def test_a_mode_is_scipys_solution_at_every_damping(ratio: float) -> None:
    h, substeps, rate = 0.01, 4, 2.0 * math.pi * 7.0
    nodes = np.random.default_rng(4).standard_normal((40, 3))
    q = mode_response(nodes, h, substeps, rate, ratio)
    state, expected = [0.0, 0.0], [[0.0, 0.0]]
    for i, u in enumerate(nodes):
        a, b, c = PARABOLA @ u

        def motion(t: float, y: FloatArray, a: float = a, b: float = b, c: float = c) -> list[float]:
            s = t / h
            return [y[1], a + b * s + c * s * s - 2.0 * ratio * rate * y[1] - rate**2 * y[0]]

        state = solve_ivp(motion, (0.0, h), state, method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
        if (i + 1) % substeps == 0:
            expected.append(state)
    found = np.array(expected).T
    assert np.abs(q - found).max(axis=1) == pytest.approx([0.0, 0.0], abs=1e-10 * np.abs(found).max())
