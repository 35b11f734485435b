"""The arrow's elimination is the dense solution, and the noise's spectrum is its covariance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from rtctl.identification.least_squares.arrowhead_solver import (
    NormalEquations,
    eliminate_local,
    make_zero_equations,
    solve_step,
)
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, Status, Unknowns, predict_gain
from rtctl.identification.noise.residual_noise import NoiseModel, compute_coloured_gram, fit_noise

FloatArray = NDArray[np.float64]


def random_arrow(p: int, segments: int, q: int, seed: int) -> tuple[NormalEquations, FloatArray, FloatArray]:
    """Normal equations of a random block-structured Jacobian; the dense matrix and gradient beside them."""
    draw = np.random.default_rng(seed)
    rows_each, unknowns = 12, p + segments * q
    blocks, residual = [], []
    for k in range(segments):
        rows = np.zeros((rows_each, unknowns))
        rows[:, :p] = draw.standard_normal((rows_each, p))
        first = p + k * q
        last = min(first + 2 * q, unknowns)  # its own and the next one's
        rows[:, first:last] = draw.standard_normal((rows_each, last - first))
        blocks.append(rows)
        residual.append(draw.standard_normal(rows_each))
    jacobian, r = np.concatenate(blocks), np.concatenate(residual)
    dense, gradient = jacobian.T @ jacobian, jacobian.T @ r
    found = make_zero_equations(p, segments, q)
    found.shared[...] = dense[:p, :p]
    found.shared_gradient[...] = gradient[:p]
    for k in range(segments):
        own = slice(p + k * q, p + (k + 1) * q)
        after = slice(p + (k + 1) * q, p + (k + 2) * q)
        found.border[k] = dense[own, :p]
        found.diagonal[k] = dense[own, own]
        found.local_gradient[k] = gradient[own]
        if k + 1 < segments:
            found.next[k] = dense[own, after]
    return found._replace(cost=0.5 * float(r @ r)), dense, gradient


@pytest.mark.parametrize(("segments", "q"), [(1, 1), (1, 2), (5, 2), (4, 1), (3, 3)])
def test_the_step_is_the_dense_one(segments: int, q: int) -> None:
    equations, dense, gradient = random_arrow(4, segments, q, seed=segments)
    shared, own = solve_step(equations, 0.1, np.zeros(4, dtype=bool))
    expected = -np.linalg.solve(dense + 0.1 * np.diag(np.diag(dense)), gradient)
    assert np.concatenate((shared, own.reshape(-1))) == pytest.approx(expected, rel=1e-9)


def test_a_frozen_unknown_stays_and_the_others_move_as_without_it() -> None:
    equations, dense, gradient = random_arrow(3, 3, 2, seed=7)
    shared, own = solve_step(equations, 0.0, np.array([False, True, False]))
    kept = np.delete(np.arange(9), 1)
    expected = -np.linalg.solve(dense[np.ix_(kept, kept)], gradient[kept])
    assert shared[1] == 0.0
    assert np.concatenate((shared[[0, 2]], own.reshape(-1))) == pytest.approx(expected, rel=1e-6)


def test_the_information_left_is_the_inverse_of_the_covariances_block() -> None:
    equations, dense, _ = random_arrow(3, 4, 2, seed=9)
    information, _ = eliminate_local(equations)
    assert information == pytest.approx(np.linalg.inv(np.linalg.inv(dense)[:3, :3]), rel=1e-6)


def test_an_autoregression_is_found_again_and_whitens() -> None:
    draw = np.random.default_rng(41)
    truth = np.array([-1.6, 0.8])
    series = [lfilter([1.0], np.append(1.0, truth), draw.standard_normal(20_000)) for _ in range(2)]
    noise = fit_noise(series)
    # standard errors of AR coefficients: sqrt((1 - 0.64) / 40,000) = 0.003
    assert noise.coefficients[:2] == pytest.approx(truth, abs=0.012)
    assert noise.variance == pytest.approx(1.0, abs=0.03)
    white = noise.whiten(series[0])
    lagged = np.correlate(white[:-1], white[1:])[0] / len(white)
    assert abs(lagged) < 4.0 / np.sqrt(len(white))


def test_white_noise_gets_no_colour() -> None:
    noise = fit_noise([np.random.default_rng(42).standard_normal(5_000)])
    assert len(noise.coefficients) == 0


def test_the_coloured_gram_is_that_of_the_covariance() -> None:
    noise = NoiseModel(np.array([-0.9]), 1.0)
    n = 400
    slopes = np.cumsum(np.random.default_rng(43).standard_normal((3, n)), axis=1)
    covariance = toeplitz(0.9 ** np.arange(n) / (1.0 - 0.81))
    assert compute_coloured_gram(slopes, noise) == pytest.approx(slopes @ covariance @ slopes.T, rel=1e-6)


@pytest.mark.parametrize(("low", "gain"), [(-10.0, 0.5 * 9.0 / 2.0), (1.0, 0.0)])
def test_a_linear_step_gains_nothing_through_a_bound(low: float, gain: float) -> None:
    equations = make_zero_equations(1, 0, 0)._replace(
        cost=5.0, shared=np.array([[2.0]]), shared_gradient=np.array([3.0])
    )
    found = Minimum(Unknowns(np.array([1.0]), np.zeros((0, 0))), equations, Status.ITERATIONS, 6)
    assert predict_gain(found, np.array([low]), np.array([10.0])) == pytest.approx(gain)
