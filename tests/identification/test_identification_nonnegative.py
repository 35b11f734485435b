"""Least squares over what cannot be negative, against SciPy's and where neighbours are alike."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from rtctl.identification.least_squares import nonnegative
from rtctl.identification.least_squares.nonnegative import (
    descend_among_feasible,
    nonnegative_least_squares,
)

claim = settings(deadline=None, max_examples=60, derandomize=True)


@claim
@given(seed=st.integers(0, 2**32), size=st.integers(1, 40), power=st.floats(-6.0, 6.0))
def test_it_is_the_nonnegative_least_squares_of_scipy_in_any_unit(seed, size, power):
    draw = np.random.default_rng(seed)
    A, y = draw.normal(size=(3 * size, size)), 10.0**power * draw.normal(size=3 * size)
    x = nonnegative_least_squares(A.T @ A, A.T @ y)
    np.testing.assert_allclose(x / 10.0**power, nnls(A, y)[0] / 10.0**power, atol=1e-9)


def alike(count=120):
    """Bumps a hundred times as wide as their distance, and a density that is 0 over half of it."""
    place = np.linspace(0.0, 1.0, count)
    A = np.exp(-0.5 * ((np.linspace(0.0, 1.0, 5 * count)[:, None] - place) / 0.05) ** 2)
    y = A @ np.maximum(np.sin(6.0 * np.pi * place), 0.0) + 0.01 * np.random.default_rng(7).normal(
        size=5 * count
    )
    gram = A.T @ A
    gram += 1e-9 * np.trace(gram) / count * np.eye(count)
    return gram, A.T @ y


def test_where_neighbours_are_alike_the_conditions_of_the_optimum_hold():
    gram, right = alike()
    x = nonnegative_least_squares(gram, right)
    gradient = gram @ x - right
    assert (x >= 0.0).all()
    assert 5 < (x > 0.0).sum() < len(x)
    assert np.abs(gradient[x > 0.0]).max() < 1e-6 * np.abs(right).max()
    assert gradient.min() > -1e-6 * np.abs(right).max()


def test_a_start_of_another_problem_changes_nothing():
    gram, right = alike()
    other = nonnegative_least_squares(gram, right[::-1].copy())
    np.testing.assert_allclose(
        nonnegative_least_squares(gram, right, other),
        nonnegative_least_squares(gram, right),
        rtol=1e-6,
        atol=1e-9,
    )


@claim
@given(seed=st.integers(0, 2**32), size=st.integers(1, 40), guess=st.sampled_from(["zeros", "random", "all"]))
def test_the_descent_reaches_the_optimum_of_scipy_from_any_start(seed, size, guess):
    draw = np.random.default_rng(seed)
    A, y = draw.normal(size=(3 * size, size)), draw.normal(size=3 * size)
    start = {"zeros": np.zeros(size), "random": draw.normal(size=size).clip(0.0), "all": np.ones(size)}[guess]
    np.testing.assert_allclose(descend_among_feasible(A.T @ A, A.T @ y, start), nnls(A, y)[0], atol=1e-9)


def test_where_pivoting_goes_round_in_circles_the_descent_answers(monkeypatch: pytest.MonkeyPatch):
    gram, right = alike()
    exact = nonnegative_least_squares(gram, right)
    monkeypatch.setattr(nonnegative, "PATIENCE", 1)
    asked = []
    descend = nonnegative.descend_among_feasible
    monkeypatch.setattr(
        nonnegative, "descend_among_feasible", lambda *given: asked.append(given) or descend(*given)
    )
    np.testing.assert_allclose(nonnegative_least_squares(gram, right), exact, rtol=1e-5, atol=1e-9)
    assert asked


def test_where_nothing_may_grow_all_is_zero():
    gram, right = alike()
    for method in (
        nonnegative_least_squares,
        lambda *system: descend_among_feasible(*system, np.zeros(len(right))),
    ):
        assert not method(gram, -gram @ np.ones(len(right))).any()
