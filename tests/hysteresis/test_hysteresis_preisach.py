"""Claims on the Preisach model: relays one by one, regressors, the full stack, the ends of the grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, claim, histories, preisach_models, scale
from hysteresis_oracles import relay_grid

from rtctl.hysteresis.preisach.corners import corner_rows
from rtctl.hysteresis.preisach.everett import cell_index, everett, everett_table
from rtctl.hysteresis.preisach.model import (
    MAX_EXTREMA,
    PreisachModel,
    preisach_run,
    preisach_slope,
    preisach_step,
)
from rtctl.hysteresis.preisach.regressors import preisach_regressors
from rtctl.interfaces import EstimateStatus


def memoryless(model, v):
    return model.c + model.c1 * v + model.c2 * v**2


def at_part_borders(model, v, per_side):
    """v moved to where parts of a cell meet: there the relay sum is exact."""
    parts = np.arange(per_side + 1) / per_side
    borders = np.unique(
        [lo + parts * (hi - lo) for lo, hi in zip(model.grid[:-1], model.grid[1:], strict=True)]
    )
    return borders[np.abs(borders[:, None] - v).argmin(axis=0)]


@claim
@given(preisach_models(), histories())
def test_it_is_the_sum_of_its_relays(model, v):
    v = at_part_borders(model, v, 4)
    expected = memoryless(model, v) + model.sign * relay_grid(v, model.grid, model.mu, 4)
    np.testing.assert_allclose(model.simulate(v), expected, rtol=0.0, atol=1e-12 * scale(model))


@claim
@given(preisach_models(), histories(), histories())
def test_regressors_times_masses_are_the_simulation(model, before, v):
    state = model.initial_state(LOW)
    preisach_run(state, before, model.params)
    for start in (None, state):
        rows = preisach_regressors(v, model.grid, start)
        y = memoryless(model, v) + model.sign * (rows @ model.mu)
        np.testing.assert_allclose(y, model.simulate(v, start), rtol=0.0, atol=1e-12 * scale(model))


@claim
@given(preisach_models(), histories(), histories(), st.data())
def test_regressors_of_a_few_samples_are_those_rows(model, before, v, data):
    wanted = np.array(data.draw(st.lists(st.booleans(), min_size=len(v), max_size=len(v))))
    state = model.initial_state(LOW)
    preisach_run(state, before, model.params)
    for start in (None, state):
        rows = preisach_regressors(v, model.grid, start, wanted)
        np.testing.assert_array_equal(rows, preisach_regressors(v, model.grid, start)[wanted])


@claim
@given(preisach_models(), histories(), st.data())
def test_rows_as_weights_of_nodes_are_those_rows(model, v, data):
    wanted = np.array(data.draw(st.lists(st.booleans(), min_size=len(v), max_size=len(v))))
    columns = np.random.default_rng(len(v)).normal(size=(int(wanted.sum()), 2))
    dense, sparse = preisach_regressors(v, model.grid, wanted=wanted), corner_rows(v, model.grid, wanted)
    close = {"rtol": 0.0, "atol": 1e-12 * max(1.0, float(wanted.sum()))}
    np.testing.assert_allclose(sparse.of(model.mu), dense @ model.mu, rtol=0.0, atol=1e-12 * scale(model))
    np.testing.assert_allclose(sparse.against(columns), dense.T @ columns, **close)
    np.testing.assert_allclose(sparse.gram(), dense.T @ dense, **close)


@pytest.mark.parametrize("rows", [preisach_regressors, corner_rows])
@pytest.mark.parametrize("grid", [[1.0], [1.0, 1.0], [2.0, 1.0]])
def test_a_grid_that_does_not_rise_is_said_for_rows_too(rows, grid):
    with pytest.raises(ValueError, match="rise strictly"):
        rows(np.ones(3), np.array(grid), wanted=np.ones(3, dtype=bool))


@claim
@given(preisach_models(), st.data())
def test_everett_at_nodes_is_a_cumulative_sum_and_bilinear_between(model, data):
    n = model.grid.size - 1
    table = everett_table(model.mu, n)
    for a in range(n + 1):
        for b in range(a):
            mass = sum(model.mu[cell_index(i, j)] for i in range(a) for j in range(b, i + 1))
            assert table[a, b] == pytest.approx(mass, abs=1e-12 * scale(model))
            found = everett(model.grid[a], model.grid[b], model.grid, table)
            assert found == pytest.approx(table[a, b], abs=1e-12 * scale(model))
    i, j = sorted(data.draw(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))), reverse=True)
    if i > j:
        x, middle = model.grid, (table[i, j] + table[i + 1, j] + table[i, j + 1] + table[i + 1, j + 1]) / 4.0
        found = everett((x[i] + x[i + 1]) / 2.0, (x[j] + x[j + 1]) / 2.0, x, table)
        assert found == pytest.approx(middle, abs=1e-12 * scale(model))


@claim
@given(st.lists(st.floats(0.0, 2.0), min_size=4, max_size=4), histories())
def test_masses_on_the_diagonal_alone_have_no_memory(diagonal, v):
    grid = np.array([LOW, 4.0, 5.5, 7.0, HIGH])
    mu = np.zeros(10)
    mu[[cell_index(i, i) for i in range(4)]] = diagonal
    model = PreisachModel(grid=grid, mu=mu, c=0.0)
    expected = np.interp(v, grid, np.concatenate(([0.0], np.cumsum(diagonal))))
    np.testing.assert_allclose(model.simulate(v), expected, atol=1e-12)


@claim
@given(preisach_models(), histories())
def test_the_slope_is_that_of_going_on_as_it_last_moved(model, v):
    state = model.initial_state(LOW)
    y = preisach_run(state, v, model.params)[-1]
    up = state[0] % 2 == 1 or state[0] == 0
    step = 1e-7 if up else -1e-7
    if not LOW <= v[-1] + step <= HIGH:
        return
    ahead = model.simulate(np.array([v[-1] + step]), state)[0]
    assert preisach_slope(state, model.params) == pytest.approx((ahead - y) / step, abs=1e-5 * scale(model))


def nested(reversals):
    """Turning points of loops that shrink, one inside the other."""
    sign = np.where(np.arange(reversals) % 2 == 0, 1.0, -1.0)
    return 6.0 + 2.0 * sign * (1.0 - np.arange(reversals) / reversals)


def uniform_model():
    return PreisachModel(grid=np.linspace(LOW, HIGH, 6), mu=np.ones(15), c=0.0)


def test_a_full_stack_forgets_the_innermost_loop_only():
    model, v = uniform_model(), nested(2 * MAX_EXTREMA)
    state = model.initial_state(LOW)
    y = preisach_run(state, v, model.params)
    assert state[0] == MAX_EXTREMA - 1 or state[0] == MAX_EXTREMA - 2
    np.testing.assert_array_equal(state[2 : MAX_EXTREMA - 1], v[: MAX_EXTREMA - 3])
    np.testing.assert_allclose(y, preisach_regressors(v, model.grid) @ model.mu, atol=1e-12)
    outer = model.simulate(np.concatenate((v[:3], [v[0], HIGH, 5.0])))[-3:]
    np.testing.assert_allclose(model.simulate(np.array([v[0], HIGH, 5.0]), state), outer, atol=1e-12)


def test_a_stack_that_is_not_full_is_exact():
    model, v = uniform_model(), nested(MAX_EXTREMA - 1)
    v = at_part_borders(model, v, 200)
    relays = relay_grid(v, model.grid, model.mu, 200)
    np.testing.assert_allclose(model.simulate(v), relays, atol=1e-9)


def test_inputs_beyond_the_grid_are_clipped_and_flagged():
    model = uniform_model()
    state = model.initial_state(6.0)
    beyond = [preisach_step(state, x, model.params) for x in (HIGH + 1.0, HIGH, LOW - 1.0, LOW)]
    flags = [int(step.status) for step in beyond]
    assert flags == [EstimateStatus.OUT_OF_RANGE, 0, EstimateStatus.OUT_OF_RANGE, 0]
    assert [step.y for step in beyond] == pytest.approx([15.0, 15.0, 0.0, 0.0])


def test_an_input_that_is_not_finite_is_held_and_flagged():
    model = uniform_model()
    state = model.initial_state(6.0)
    y, kept = model.simulate(np.array([6.0]))[0], state.copy()
    for x in (np.nan, np.inf):
        assert preisach_step(state, x, model.params) == (y, EstimateStatus.NOT_FINITE)
    np.testing.assert_array_equal(state, kept)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"mu": -np.ones(15)}, "masses mu must be >= 0, got -1"),
        ({"mu": np.ones(14)}, r"mu must have shape \(15,\)"),
        ({"grid": np.linspace(HIGH, LOW, 6)}, "rise strictly"),
        ({"sign": 0.5}, "sign must be 1 or -1"),
    ],
)
def test_a_measure_that_is_none_is_refused(change, complaint):
    with pytest.raises(ValueError, match=complaint):
        PreisachModel(**{"grid": np.linspace(LOW, HIGH, 6), "mu": np.ones(15), "c": 0.0, **change})
