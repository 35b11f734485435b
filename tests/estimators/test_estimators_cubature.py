"""The kernels of the cubature filter against NumPy, and its laws against those of the simulation."""

from __future__ import annotations

from pathlib import Path

import numba
import numpy as np
import pytest

from plant_sim.equations.controlled import ControlledEquations
from rtctl.border.errors import InputError
from rtctl.border.kernels import first_class
from rtctl.estimators.equations.cubature_kernel import FilterParams, correct, room_size
from rtctl.estimators.equations.gaussian import solve_triangular, spread_points, take_moments, triangularise
from rtctl.estimators.equations.laws import law_function, laws_of
from rtctl.estimators.equations.step import whole_steps

MODELS = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations"
RNG = np.random.default_rng(4)


@pytest.mark.parametrize(("n", "columns"), [(1, 3), (3, 9), (5, 21)])
def test_a_triangular_root_is_that_of_the_product(n: int, columns: int) -> None:
    a = RNG.standard_normal((n, columns)) * 10.0 ** RNG.uniform(-6.0, 6.0, (n, 1))
    root = np.full(n * n, np.nan)
    triangularise(a.ravel().copy(), n, root)
    found = root.reshape(n, n)
    assert np.array_equal(found, np.tril(found))
    assert np.allclose(found @ found.T, a @ a.T, rtol=1e-12, atol=0.0)
    x, b = np.empty(n), RNG.standard_normal(n)
    solve_triangular(root, n, b, x)
    assert np.allclose(a @ (a.T @ x), b, rtol=1e-6, atol=1e-6)


def test_a_row_of_zeros_has_a_root_too() -> None:
    root = np.full(4, np.nan)
    triangularise(np.array([0.0, 0.0, 0.0, 3.0, 4.0, 0.0]), 2, root)
    assert root.tolist() == [0.0, 0.0, 0.0, 5.0]


def test_points_have_the_moments_that_they_were_spread_by() -> None:
    n, x, scale = 4, RNG.standard_normal(4), 10.0 ** RNG.uniform(-3.0, 3.0, 4)
    root = np.tril(RNG.standard_normal((n, n)))
    points, wide = np.empty(2 * n * n), np.empty(3 * n * n)
    spread_points(x, root.ravel(), scale, np.full(n, -np.inf), np.full(n, np.inf), points)
    mean, found, added = np.empty(n), np.empty(n * n), np.array([0.5, 0.0, 2.0, 1.0])
    take_moments(points, scale, added, 0.25, mean, found, wide)
    again = found.reshape(n, n)
    assert np.allclose(mean, x)
    assert np.allclose(again @ again.T, root @ root.T + np.diag(added**2 * 0.25))


def test_a_correction_is_that_of_the_covariances() -> None:
    """Oracle: K = C S^-1, P - K S K' with S taken larger by a surprising reading, in plain NumPy."""
    n, m = 3, 2
    h = RNG.standard_normal((m + 1, n))

    def linear(x, u, p, out):  # type: ignore[no-untyped-def]
        for k in range(out.size):
            out[k] = u[0]
            for i in range(x.size):
                out[k] += h[k, i] * x[i]
        return 0

    outputs = first_class(numba.njit(linear), *[np.empty(1)] * 4)
    for surprise in (1.0, 40.0):
        root, x = np.tril(RNG.standard_normal((n, n))), RNG.standard_normal(n)
        scale, noise, u = np.array([2.0, 0.1, 30.0]), np.array([0.3, 0.02]), np.array([0.7])
        params = FilterParams(
            outputs=m + 1, shown=2, parameters=np.empty(0), low=np.full(n, -np.inf), high=np.full(n, np.inf),
            scale=scale, added=np.zeros(n), corrected=np.ones(n), sensed=np.array([0.0, 1.0]), noise=noise, most=9.0,
            step_s=1.0,
        )  # fmt: skip
        p = (scale[:, None] * root) @ (scale[:, None] * root).T
        c, s = p @ h[:m].T, h[:m] @ p @ h[:m].T + np.diag(noise**2)
        off = np.linalg.cholesky(s) @ np.full(m, surprise)
        grown = max(1.0, float(off @ np.linalg.solve(s, off)) / 9.0)
        gain = c @ np.linalg.inv(grown * s)
        expected, left = x + gain @ off, p - gain @ (grown * s) @ gain.T
        z = h[:m] @ x + u[0] + off
        found, own, room = x.copy(), root.ravel().copy(), np.empty(room_size(n, m, m + 1))
        value, innovation, error, status = correct(outputs, found, own, u, z, params, room)
        after = scale[:, None] * own.reshape(n, n)
        assert np.allclose(found, expected)
        assert np.allclose(after @ after.T, left)
        assert value == pytest.approx(h[2] @ expected + u[0])
        assert innovation == pytest.approx(off[0])
        assert error == pytest.approx(np.sqrt(h[2] @ left @ h[2]))
        assert status == (16 if grown > 1.0 else 0)


@pytest.mark.parametrize(
    ("elapsed", "step", "steps"), [(1e-3, 1e-3, 1), (1e-3, 4e-4, 3), (5e-3, 1e-3, 5), (1e-6, 1.0, 1)]
)
def test_a_time_is_divided_into_steps_that_are_no_longer(elapsed: float, step: float, steps: int) -> None:
    assert whole_steps(elapsed, step) == steps


def test_laws_of_estimators_are_those_of_the_simulation() -> None:
    """Two writers and two libraries of functions compute the same equations."""
    compared = 0
    for path in sorted(MODELS.glob("*.toml")):
        try:
            model = ControlledEquations(path)
        except InputError:
            continue  # no device
        n = len(model.initial)
        size = np.maximum(np.abs(model.initial), 0.1)
        x = np.clip(model.initial + size * RNG.uniform(-1.0, 1.0, (20, n)), model.low, model.high)
        levels = model.command_range.mean(axis=1).tolist()
        levels = [one if np.isfinite(one) else 1.0 for one in levels]
        laws, u = laws_of(model), model.input_si(levels)
        plain = law_function(model, "rates")
        for row in x:
            rates, outputs, again = np.empty(n), np.empty(len(model.outputs)), np.empty(n)
            laws.rates(row, u, model.parameters, rates)
            laws.outputs(row, u, model.parameters, outputs)
            plain(row, u, model.parameters, again)
            inside = (row > model.low) & (row < model.high)
            assert np.array_equal(rates, again, equal_nan=True), path.stem
            assert np.allclose(
                rates[inside], model.rates(row[None], levels)[0][inside], rtol=1e-10, atol=0.0
            ), path.stem
            assert np.allclose(outputs, model.all_outputs(row[None], levels)[0], rtol=1e-12, atol=1e-300), (
                path.stem
            )
        compared += 1
    assert compared >= 8
