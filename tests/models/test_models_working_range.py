"""Where a model can be controlled, read off the major loop of a model whose loop is known."""

from __future__ import annotations

import numpy as np
import pytest
from vo2_cases import DEVICES

from rtctl.hysteresis.preisach.everett import cell_index
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.models.span import Span
from rtctl.models.working_range import working_range

CURRENT = Span(0.0, 10.0)


def one_cell(*, mass=10.0, c1=-1.0, c2=0.0):
    """All relays switch on between 6 and 7 and off between 4 and 5; expansion falls with c1 v + c2 v^2."""
    mu = np.zeros(55)
    mu[cell_index(6, 4)] = mass
    return PreisachModel(grid=np.arange(11.0), mu=mu, c=20.0, c1=c1, c2=c2)


def test_the_range_runs_from_the_cooling_minimum_to_the_heating_maximum():
    found = working_range(one_cell(), CURRENT, points=1001)
    # cooling: 20 + 10 (v - 4) - v between 4 and 5, falling on either side; heating alike between 6 and 7
    assert found.current == pytest.approx((4.0, 7.0), abs=0.011)
    assert found.deflection == pytest.approx((16.0, 23.0), abs=0.02)
    assert found.steepest_slope == pytest.approx(9.0)


def test_a_model_that_rises_everywhere_is_controlled_over_the_whole_range():
    found = working_range(one_cell(c1=0.5), CURRENT)
    assert found.current == pytest.approx((0.0, 10.0))
    assert found.deflection == pytest.approx((20.0, 35.0))
    assert found.steepest_slope == pytest.approx(10.5)


def test_a_deep_and_steep_fall_beyond_the_transition_is_left_out():
    """Gains are tuned on the steepest rise: a steeper fall outside the working range says nothing about the loop."""
    mu = np.zeros(210)
    mu[cell_index(6, 4)] = 10.0
    model = PreisachModel(grid=np.arange(21.0), mu=mu, c=20.0, c2=-0.25)
    found = working_range(model, Span(0.0, 20.0), points=2001)  # at 20 mA 10 um/mA downwards, 86 um deeper
    assert found.current == pytest.approx((4.0, 7.0), abs=0.011)
    assert found.deflection == pytest.approx((16.0, 17.75), abs=0.02)
    assert found.steepest_slope == pytest.approx(
        10.0 - 0.5 * 4.1, rel=0.01
    )  # cooling, the first 0.2 mA from 4 mA


def test_a_steep_cell_narrower_than_one_percent_is_averaged():
    grid = np.array([0.0, 5.0, 5.02, 10.0])
    mu = np.zeros(6)
    mu[cell_index(1, 1)] = 1.0
    model = PreisachModel(grid=grid, mu=mu, c=0.0, c1=0.1)
    assert working_range(model, CURRENT).steepest_slope == pytest.approx(1.0 / 0.1 + 0.1, rel=0.02)


def test_a_model_that_only_falls_is_refused():
    with pytest.raises(ValueError, match="falls with current"):
        working_range(one_cell(mass=0.0), CURRENT)


@pytest.mark.parametrize("name", DEVICES)
def test_an_identified_device_keeps_most_of_its_deflection(identified, name):
    model = identified(name).model
    found = working_range(model.deflection_preisach, model.current)
    assert model.current.low <= found.current.low < found.current.high <= model.current.high
    assert found.deflection.width > 0.85 * model.deflection.width
    assert found.steepest_slope > model.deflection.width / model.current.width
