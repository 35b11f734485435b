"""Preisach identification: grid, roughness, smoothness, and a population of relays given back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.hysteresis.preisach.everett import cell_index
from rtctl.identification.vo2.preisach_fit import AXIS_WEIGHT, build_roughness, choose_grid, fit_preisach

claim = settings(deadline=None, max_examples=60, derandomize=True)


def relays(v, *, count=4000, seed=5):
    """Mass that is on, relay by relay, all off at first: switching points on 3.7 to 8.5, widths about 0.6."""
    draw = np.random.default_rng(seed)
    centre = draw.normal(6.2, 0.45, count)
    half = 0.5 * np.abs(draw.normal(0.6, 0.2, count))
    on, outputs = np.zeros(count, bool), []
    for x in v:
        on = (x >= centre + half) | (on & (x > centre - half))
        outputs.append(on.mean())
    return np.array(outputs)


def identification_inputs():
    """A cold start, a damped oscillation, first-order reversals of both branches, in steps of 1 % of the range."""
    turns = [3.7, 8.5]
    for k in range(1, 9):
        turns += [6.2 - (1.0 - k / 9) * 2.5, 6.2 + (1.0 - k / 9) * 2.3]
    for point in np.linspace(5.2, 7.6, 12):
        turns += [3.7, point]
    turns += [3.7, 8.5]
    for point in np.linspace(7.6, 5.2, 12):
        turns += [point, 8.5]
    legs = [
        np.linspace(a, b, max(2, round(abs(b - a) / 0.048)))[1:]
        for a, b in zip(turns[:-1], turns[1:], strict=True)
    ]
    return np.concatenate(([0.0, 3.7], *legs))


@pytest.fixture(scope="module")
def fitted():
    v = identification_inputs()
    y = relays(v) + 0.02 * v**2
    return v, y, fit_preisach(v, y, v > 0.0, cells=30)


def test_minor_loops_of_unseen_staircases_are_predicted(fitted):
    _, y, fit = fitted
    draw = np.random.default_rng(11)
    unseen = np.concatenate(([3.7], draw.uniform(4.5, 8.5, 400)))
    error = np.abs(fit.model.simulate(unseen) - relays(unseen) - 0.02 * unseen**2) / np.ptp(y)
    # a cell is about 0.08 mA: twice in a hysteresis of 0.6 mA it may be off by a part of its mass
    assert error.mean() < 0.004
    assert error.max() < 0.02


def test_the_reported_residual_is_that_of_the_model_itself(fitted):
    v, y, fit = fitted
    np.testing.assert_allclose((y - fit.model.simulate(v))[v > 0.0], fit.residual, atol=1e-9)


def test_masses_are_not_negative_and_the_hysteretic_part_rises(fitted):
    _, _, fit = fitted
    assert (fit.model.mu >= 0.0).all()
    ramp = np.linspace(3.7, 8.5, 500)
    hysteretic = fit.model.simulate(ramp) - fit.model.c2 * ramp**2
    assert (np.diff(hysteretic) >= -1e-12).all()


def test_the_empty_cells_of_another_model_as_first_guess_change_nothing(fitted):
    v, y, fit = fitted
    nodes = choose_grid(v, y, 24, uniform_share=0.6)
    alone = fit_preisach(v, y, v > 0.0, nodes=nodes).model
    guessed = fit_preisach(v, y, v > 0.0, nodes=nodes, near=fit.model).model
    np.testing.assert_allclose(guessed.mu, alone.mu, atol=1e-9)


def test_where_no_data_speak_the_density_goes_on_smoothly():
    v = np.concatenate(([0.0], np.linspace(3.7, 8.5, 60), np.linspace(8.5, 3.7, 60)))  # the major loop alone
    fit = fit_preisach(v, relays(v), v > 0.0, cells=20)
    minor = np.concatenate(([3.7], np.random.default_rng(11).uniform(4.5, 8.5, 400)))
    assert np.abs(fit.model.simulate(minor) - relays(minor)).mean() < 0.008, "no loop within it was measured"
    assert np.abs(fit.residual).max() < 0.02, "and what was measured is fitted all the same"


def test_a_falling_output_is_modelled_by_its_negative():
    v = identification_inputs()
    y = -relays(v)
    rising = fit_preisach(v, -y, v > 0.0, cells=12)
    falling = fit_preisach(v, y, v > 0.0, cells=12, sign=-1.0)
    np.testing.assert_allclose(falling.residual, -rising.residual, atol=1e-12)
    np.testing.assert_allclose(falling.model.simulate(v), -rising.model.simulate(v), atol=1e-9)


@pytest.mark.parametrize("memoryless", [(False, False), (True, False), (False, True), (True, True)])
def test_the_memoryless_terms_asked_for_are_found_and_no_others(memoryless):
    v = identification_inputs()
    linear, quadratic = (value if used else 0.0 for value, used in zip((0.3, -0.05), memoryless, strict=True))
    y = relays(v) + 2.0 + linear * v + quadratic * v**2
    model = fit_preisach(v, y, v > 0.0, cells=20, memoryless=memoryless).model
    assert ((model.c1 != 0.0), (model.c2 != 0.0)) == memoryless
    assert np.abs(model.simulate(v) - y)[v > 0.0].mean() < 0.004


@claim
@given(
    cells=st.integers(1, 40),
    share=st.floats(0.01, 1.0),
    turns=st.lists(st.floats(3.0, 9.0), min_size=2, max_size=20).filter(lambda x: max(x) - min(x) > 0.1),
)
def test_the_grid_rises_strictly_and_spans_the_data(cells, share, turns):
    v = np.array(turns)
    grid = choose_grid(v, np.tanh(v - 6.0), cells, uniform_share=share)
    assert grid.shape == (cells + 1,)
    assert grid[0] == pytest.approx(v.min(), abs=1e-12)
    assert grid[-1] == pytest.approx(v.max(), abs=1e-12)
    widths = np.diff(grid)
    assert (widths > 0.0).all()
    # density >= share / range everywhere: no cell is wider than that allows
    assert widths.max() <= np.ptp(v) / cells / share * (1.0 + 1e-9)


def test_the_textbook_grid_is_uniform_and_another_is_dense_where_the_output_changes():
    v = np.linspace(0.0, 10.0, 2001)
    y = np.tanh(4.0 * (v - 7.0))
    np.testing.assert_allclose(choose_grid(v, y, 10, uniform_share=1.0), np.arange(11.0), atol=1e-9)
    widths = np.diff(choose_grid(v, y, 40, uniform_share=0.5))
    assert widths.min() < 0.15 < 10.0 / 40 < widths.max()
    assert choose_grid(v, y, 40, uniform_share=0.5)[widths.argmin()] == pytest.approx(7.0, abs=0.15)


def test_the_jump_between_two_records_draws_no_nodes():
    v = np.concatenate(([0.0], np.linspace(3.7, 8.5, 60), [0.0], np.linspace(4.0, 6.0, 30)))
    y = np.tanh(4.0 * (v - 7.0))
    order = np.concatenate((np.arange(61, 92), np.arange(61)))
    grids = [
        choose_grid(v[k], y[k], 20, uniform_share=0.3, scored=v[k] > 0.0) for k in (np.arange(92), order)
    ]
    np.testing.assert_allclose(grids[0], grids[1], atol=1e-12)
    assert (grids[0][0], grids[0][-1]) == (3.7, 8.5)


def differences(nodes):
    """Rows of second differences of the density, one cell in the middle at a time."""
    n = len(nodes) - 1
    width = np.diff(nodes)
    cells = [(i, j) for i in range(n) for j in range(i + 1)]
    area = {(i, j): width[i] * width[j] * (0.5 if i == j else 1.0) for i, j in cells}  # diagonal: triangles
    middle = np.median(list(area.values()))
    rows = []
    for i, j in cells:
        for a, b in ((1, 0), (0, 1), (1, 1)):
            before, after = (i - a, j - b), (i + a, j + b)
            if before in area and after in area:
                row = np.zeros(len(cells))
                for cell, size in ((before, 1.0), ((i, j), -2.0), (after, 1.0)):
                    row[cell_index(*cell)] = size * middle / area[cell]
                rows.append(row * np.sqrt(1.0 if a == b else AXIS_WEIGHT))
    return np.array(rows).reshape(-1, len(cells))


@claim
@given(st.lists(st.floats(0.01, 3.0), min_size=1, max_size=7))
def test_roughness_is_the_square_of_second_differences_of_the_density(widths):
    nodes = np.concatenate(([0.0], np.cumsum(widths)))
    rows = differences(nodes)
    np.testing.assert_allclose(build_roughness(nodes), rows.T @ rows, rtol=1e-9, atol=1e-12)


def test_noise_is_smoothed_and_exact_readings_are_not():
    v = identification_inputs()
    exact, unseen = relays(v), np.random.default_rng(3).uniform(4.5, 8.5, 400)
    draw = np.random.default_rng(4)
    for rms, most in ((0.0, 0.004), (0.02, 0.008)):
        y = exact + rms * draw.normal(size=len(v))
        chosen, rough = (
            fit_preisach(v, y, v > 0.0, cells=30, smoothness=weight).model.simulate(np.r_[3.7, unseen])
            - relays(np.r_[3.7, unseen])
            for weight in (None, 1e-4)
        )
        assert np.abs(chosen).mean() < most
        assert chosen.std() < (0.8 if rms else 1.25) * rough.std()
