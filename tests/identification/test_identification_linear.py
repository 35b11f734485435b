"""The inner problem of every fit: some coefficients free, some non-negative."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from rtctl.identification.least_squares.linear import fit_partly_nonnegative

claim = settings(deadline=None, max_examples=60, derandomize=True)


def problem(seed, samples, free, nonnegative):
    draw = np.random.default_rng(seed)
    columns = draw.normal(size=(samples, free)), draw.normal(size=(samples, nonnegative))
    return *columns, draw.normal(size=samples)


@claim
@given(seed=st.integers(0, 2**32), free=st.integers(1, 4), nonnegative=st.integers(0, 8))
def test_the_partly_nonnegative_fit_is_that_of_lsq_linear(seed, free, nonnegative):
    F, W, y = problem(seed, 30, free, nonnegative)
    fit = fit_partly_nonnegative(F, W, y)
    low = np.concatenate((np.full(free, -np.inf), np.zeros(nonnegative)))
    oracle = lsq_linear(np.hstack((F, W)), y, (low, np.inf), method="bvls", tol=1e-14)
    np.testing.assert_allclose(np.concatenate((fit.free, fit.nonnegative)), oracle.x, atol=1e-8)
    np.testing.assert_allclose(fit.residual, y - F @ fit.free - W @ fit.nonnegative, atol=1e-12)


@claim
@given(seed=st.integers(0, 2**32), power=st.floats(-12.0, 12.0))
def test_the_unit_of_a_column_scales_its_coefficient_and_nothing_else(seed, power):
    F, W, y = problem(seed, 30, 2, 5)
    scale = np.array([10.0**power, 1.0, 1.0, 10.0**-power, 1.0])
    plain, scaled = fit_partly_nonnegative(F, W, y), fit_partly_nonnegative(F, W * scale, y)
    np.testing.assert_allclose(scaled.nonnegative * scale, plain.nonnegative, atol=1e-9)
    np.testing.assert_allclose(scaled.residual, plain.residual, atol=1e-9)


@claim
@given(seed=st.integers(0, 2**32), power=st.floats(-9.0, 9.0))
def test_columns_that_the_free_ones_already_span_get_no_weight(seed, power):
    F, W, y = problem(seed, 30, 2, 4)
    W[:, 1] = 10.0**power * (F @ [0.7, -1.3])
    W[:, 3] = 0.0
    fit = fit_partly_nonnegative(F, W, y)
    assert fit.nonnegative[[1, 3]].tolist() == [0.0, 0.0]
    kept = fit_partly_nonnegative(F, W[:, [0, 2]], y)
    np.testing.assert_allclose(fit.residual, kept.residual, atol=1e-9)


def test_a_target_that_the_columns_make_leaves_nothing():
    F, W, _ = problem(7, 40, 2, 3)
    fit = fit_partly_nonnegative(F, W, F @ [3.0, -4.0] + W @ [0.5, 0.0, 2.0])
    assert fit.free == pytest.approx([3.0, -4.0])
    assert fit.nonnegative == pytest.approx([0.5, 0.0, 2.0], abs=1e-12)
    assert np.abs(fit.residual).max() < 1e-12
