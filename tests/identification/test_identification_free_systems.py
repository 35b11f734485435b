"""Systems among changing sets of free variables against a solution of each set by itself."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.identification.least_squares.free_systems import FreeSystems


def _system(seed: int, size: int = 120) -> tuple[np.ndarray, np.ndarray, np.random.Generator]:
    draw = np.random.default_rng(seed)
    columns = np.cumsum(draw.normal(size=(3 * size, size)), axis=1)  # neighbours are similar
    return columns.T @ columns + 1e-3 * np.eye(size), draw.normal(size=size), draw


def _among(gram: np.ndarray, right: np.ndarray, free: np.ndarray) -> np.ndarray:
    x = np.zeros(len(right))
    x[free] = np.linalg.solve(gram[np.ix_(free, free)], right[free])
    return x


@pytest.mark.parametrize("seed", range(5))
def test_each_set_of_a_sequence_has_its_own_solution(seed):
    gram, right, draw = _system(seed)
    systems, free, factorised = FreeSystems(gram, right), draw.random(120) < 0.6, []
    for changes in (0, 2, 3, 1, 0, 1, 60, 4, 1):
        free[draw.choice(120, changes, replace=False)] ^= True
        x, expected = systems.solve(free), _among(gram, right, free)
        np.testing.assert_allclose(x, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
        assert not x[~free].any()
        factorised.append(systems.is_factorised(free))
    assert factorised == [True, False, False, False, False, False, True, False, False]
    np.testing.assert_allclose(
        systems.factorise(free), expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max()
    )
    assert systems.is_factorised(free)


def test_a_variable_that_comes_back_has_the_solution_from_before():
    gram, right, draw = _system(7)
    systems, free = FreeSystems(gram, right), draw.random(120) < 0.5
    first = systems.solve(free)
    for place in (3, 50, 3, 50):
        free[place] ^= True
        again = systems.solve(free)
    np.testing.assert_allclose(again, first, rtol=1e-9, atol=1e-12 * np.abs(first).max())


def test_no_free_variable_is_zero_everywhere():
    gram, right, _ = _system(1)
    systems = FreeSystems(gram, right)
    assert not systems.solve(np.zeros(120, dtype=bool)).any()
    systems.solve(np.ones(120, dtype=bool))
    assert not systems.solve(np.zeros(120, dtype=bool)).any()


def test_a_matrix_that_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError, match="order 2 is not positive definite"):
        FreeSystems(np.diag([1.0, -1.0, 1.0]), np.ones(3)).solve(np.ones(3, dtype=bool))
