"""Grids by a model's own masses: small cells where relays switch together, none lost where the density is even."""

from __future__ import annotations

import numpy as np

from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.identification.vo2.adapted_grid import adapt_nodes, compute_switching_densities

CELLS = 40
UPPER, LOWER = np.tril_indices(CELLS)
GRID = np.linspace(3.0, 8.0, CELLS + 1)


def model_of(mu):
    return PreisachModel(grid=GRID, mu=mu, c=0.0)


def test_an_even_density_of_narrow_relays_keeps_even_cells():
    mu = np.where(UPPER == LOWER, 1.0, 0.0)
    nodes = adapt_nodes(model_of(mu), CELLS)
    np.testing.assert_allclose(nodes, GRID, rtol=1e-12)


def test_a_domain_that_switches_as_one_gets_small_cells_where_it_heats_and_where_it_cools():
    mu = np.full(len(UPPER), 1e-3)
    up, down = 30, 12
    mu[(up == UPPER) & (down == LOWER)] = 5.0
    nodes = adapt_nodes(model_of(mu), CELLS)
    assert len(nodes) == CELLS + 1
    assert (np.diff(nodes) > 0.0).all()
    for cell in (up, down):
        near = (nodes > GRID[cell - 1]) & (nodes < GRID[cell + 2])
        assert near.sum() >= 8  # of a uniform grid: 3


def test_densities_are_the_mass_per_field():
    mu = np.random.default_rng(3).uniform(size=len(UPPER))
    up, down = compute_switching_densities(model_of(mu))
    np.testing.assert_allclose([up @ np.diff(GRID), down @ np.diff(GRID)], mu.sum(), rtol=1e-12)
    np.testing.assert_allclose(up[7] * np.diff(GRID)[7], mu[UPPER == 7].sum(), rtol=1e-12)


def test_without_any_mass_the_grid_is_uniform():
    np.testing.assert_allclose(adapt_nodes(model_of(np.zeros(len(UPPER))), 10), np.linspace(3.0, 8.0, 11))
