"""Claims on the inverse of a rising Preisach model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, claim, histories, preisach_models, scale

from rtctl.hysteresis.preisach.inverse import (
    check_invertible,
    invert_preisach,
    preisach_inverse_step,
    preisach_invert,
)
from rtctl.hysteresis.preisach.model import PreisachModel, preisach_run, preisach_slope
from rtctl.interfaces import EstimateStatus

STAIRS = PreisachModel(grid=np.array([4.0, 5.0, 6.0]), mu=np.array([1.0, 0.0, 1.0]), c=0.0)


@claim
@given(preisach_models(rising=True), histories(), histories())
def test_the_inverse_of_the_model_is_v(model, before, v):
    state = model.initial_state(LOW)
    preisach_run(state, before, model.params)
    found, slope, status = invert_preisach(model, model.simulate(v, state), state)
    np.testing.assert_allclose(found, v, rtol=0.0, atol=1e-9)
    assert (status == EstimateStatus.OK).all()
    assert (slope > 0.0).all()


@claim
@given(preisach_models(rising=True), histories(), st.floats(-0.2, 1.2))
def test_asking_leaves_the_state_alone_and_stepping_moves_it_there(model, before, part):
    state = model.initial_state(LOW)
    preisach_run(state, before, model.params)
    kept = state.copy()
    low, high = model.simulate(np.array([LOW]))[0], model.simulate(np.array([HIGH]))[0]
    y = low + part * (high - low)
    asked = preisach_invert(state, y, model.params)
    np.testing.assert_array_equal(state, kept)
    assert preisach_inverse_step(state, y, model.params) == asked
    reached = state[1 + int(state[0])]
    assert reached == asked.v
    inside = min(max(y, low), high)
    assert model.simulate(np.array([asked.v]), kept)[0] == pytest.approx(inside, abs=1e-9 * scale(model))


@claim
@given(preisach_models(rising=True), histories())
def test_the_slope_beside_the_answer_is_the_models(model, v):
    state = model.initial_state(LOW)
    for y in model.simulate(v, state):
        point = preisach_inverse_step(state, y, model.params)
    corners = np.concatenate((model.grid, v[:-1]))  # there the two sides differ, and rounding picks one
    assume(np.abs(corners - point.v).min() > 1e-6)
    assert point.slope == pytest.approx(preisach_slope(state, model.params), abs=1e-6 * scale(model))


def test_a_loop_that_the_answer_closes_to_the_bit_is_left():
    """Falling back to a minimum is on the branch outside the loop, as is rising back to a maximum."""
    model = PreisachModel(grid=STAIRS.grid, mu=np.array([1.0, 2.0, 1.0]), c=0.0)
    for v in ([5.8, 4.2, 5.0], [4.2, 5.8, 5.0, 5.8, 4.2, 5.0, 4.5]):
        state = model.initial_state(4.0)
        preisach_run(state, np.array(v), model.params)
        back = v[-2]
        y = model.simulate(np.array([back]), state)[0]
        point = preisach_inverse_step(state, y, model.params)
        assert (point.v, point.slope) == (back, preisach_slope(state, model.params))


def test_where_the_output_stands_still_the_nearest_input_is_given_and_flagged():
    flat = PreisachModel(grid=np.array([4.0, 5.0, 6.0, 7.0]), mu=np.array([1.0, 0, 0, 0, 0, 1.0]), c=0.0)
    found, slope, status = invert_preisach(flat, np.array([0.5, 1.0, 1.5, 1.0]))
    np.testing.assert_allclose(found, [4.5, 5.0, 6.5, 6.0])
    assert status.tolist() == [0, EstimateStatus.IN_GAP, 0, EstimateStatus.IN_GAP]
    assert slope.tolist() == [1.0, 0.0, 1.0, 0.0]


def test_a_reading_beyond_the_grid_is_answered_with_its_end_and_flagged():
    found, _, status = invert_preisach(STAIRS, np.array([2.5, 1.0, -0.5]))
    np.testing.assert_allclose(found, [6.0, 5.0, 4.0])
    beyond = EstimateStatus.SATURATED | EstimateStatus.OUT_OF_RANGE
    assert (status & beyond).tolist() == [beyond, 0, beyond]


def test_a_reading_that_is_not_finite_holds_the_last_input():
    state = STAIRS.initial_state(4.5)
    for y in (np.nan, np.inf):
        point = preisach_invert(state, y, STAIRS.params)
        assert (point.v, point.slope, point.status) == (4.5, 1.0, EstimateStatus.NOT_FINITE)


@pytest.mark.parametrize("change", [{"sign": -1.0}, {"c1": -0.1}, {"c1": 0.5, "c2": -0.1}])
def test_a_model_that_may_fall_is_refused(change):
    model = PreisachModel.from_table({**STAIRS.to_table(), **change})
    with pytest.raises(ValueError, match="only a rising Preisach model"):
        check_invertible(model)
