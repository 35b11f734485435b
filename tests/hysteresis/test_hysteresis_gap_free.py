"""Claims on the gap-free model: its inverse is exact both ways, its ends are flagged, its slope is true."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, claim, gap_free_models, histories, scale

from rtctl.hysteresis.gap_free import GapFreeModel, gap_free_inverse_step, gap_free_run, gap_free_step
from rtctl.interfaces import EstimateStatus

MODEL = GapFreeModel(
    p=np.array([0.8, 0.4, 0.5]), r=np.array([0.0, 0.2, 0.5]), a_R=np.array([1.0, 1.5, 3.0]),
    b_R=np.array([-7.2, -10.0, -19.0]), a_L=np.array([1.0, 1.5, 3.0]), b_L=np.array([-6.6, -9.5, -17.5]),
    q1=0.2, q2=0.01, c=-1.0, v_low=LOW, v_high=HIGH,
)  # fmt: skip


@claim
@given(gap_free_models(), histories(), histories())
def test_the_inverse_of_the_model_is_v(model, before, v):
    state = model.initial_state(LOW)
    gap_free_run(state, before, model.params)
    found, slope, status = model.invert(model.simulate(v, state), state)
    np.testing.assert_allclose(found, v, rtol=0.0, atol=1e-9)
    assert (status == EstimateStatus.OK).all()
    assert (slope >= model.q1).all()


@claim
@given(gap_free_models(), histories(), st.lists(st.floats(0.0, 1.0), min_size=2, max_size=30).map(np.array))
def test_the_model_of_the_inverse_is_y(model, before, parts):
    state = model.initial_state(LOW)
    gap_free_run(state, before, model.params)
    ends = model.simulate(np.array([HIGH, LOW]), state)
    y = ends[1] + parts * (ends[0] - ends[1])
    found, _, status = model.invert(y, state)
    inside = status == EstimateStatus.OK  # after the first turn the lowest y may be above ends[1]
    np.testing.assert_allclose(
        model.simulate(found, state)[inside], y[inside], rtol=0.0, atol=1e-9 * scale(model)
    )


@claim
@given(gap_free_models(), histories(), histories())
def test_forward_and_inverse_hand_the_same_state_over(model, v, after):
    state = model.initial_state(LOW)
    forward, inverse = state.copy(), state.copy()
    for x in v:
        gap_free_inverse_step(inverse, gap_free_step(forward, x, model.params), model.params)
    np.testing.assert_allclose(inverse, forward, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(
        model.simulate(after, inverse), model.simulate(after, forward), atol=1e-7 * scale(model)
    )


@claim
@given(st.floats(0.02, 1.0), st.floats(0.0, 0.2), histories())
def test_without_plays_it_is_the_root_of_a_parabola(q1, q2, v):
    plain = GapFreeModel.from_table({**MODEL.to_table(), "p": [0.0] * 3, "q1": q1, "q2": q2, "c": 0.0})
    y = q1 * v + q2 * v**2
    found, slope, _ = plain.invert(y)
    np.testing.assert_allclose(found, 2.0 * y / (q1 + np.sqrt(q1**2 + 4.0 * q2 * y)), atol=1e-10)
    np.testing.assert_allclose(slope, q1 + 2.0 * q2 * v, atol=1e-10)


@claim
@given(gap_free_models(), histories())
def test_the_slope_is_that_of_going_on_as_it_last_moved(model, v):
    corners = np.concatenate((v[:-1], [LOW, HIGH]))  # there the two sides differ, and rounding picks one
    assume(np.abs(corners - v[-1]).min() > 1e-3)
    state = model.initial_state(LOW)
    y = gap_free_run(state.copy(), v, model.params)
    slope = model.invert(y, state)[1][-1]
    step = 1e-6 * np.sign(v[-1] - v[-2])
    further = model.simulate(np.concatenate((v, v[-1] + step * np.array([1.0, 2.0]))), state)[-2:]
    ahead = (further[1] - further[0]) / step
    behind = (further[0] - y[-1]) / step
    # between two samples a play may start to move: the slope then lies between those beside it
    assert min(ahead, behind) - 1e-3 * scale(model) <= slope <= max(ahead, behind) + 1e-3 * scale(model)


def test_a_reading_beyond_the_range_is_answered_with_its_end_and_flagged():
    y = MODEL.simulate(np.array([LOW, HIGH, 6.0]))
    found, _, status = MODEL.invert(np.array([y[0] - 1.0, y[1] + 1.0, y[1] + 5.0, y[2]]))
    np.testing.assert_allclose(found, [LOW, HIGH, HIGH, 6.0], atol=1e-9)
    beyond = EstimateStatus.SATURATED | EstimateStatus.OUT_OF_RANGE
    assert status.tolist() == [beyond, beyond, beyond, EstimateStatus.OK]


def test_a_reading_that_is_not_finite_holds_everything():
    state = MODEL.initial_state(6.0)
    kept = state.copy()
    for y in (np.nan, np.inf, -np.inf):
        point = gap_free_inverse_step(state, y, MODEL.params)
        assert (point.v, point.status) == (6.0, EstimateStatus.NOT_FINITE)
        assert point.slope >= MODEL.q1
    assert np.isnan(gap_free_step(state, np.nan, MODEL.params))
    np.testing.assert_array_equal(state, kept)


def test_noise_at_rest_moves_the_surrogate_by_noise_over_the_reversible_slope():
    """The cure for the gap: no branch to flip, so v moves no more than the noise over the least slope."""
    noise = 1e-3 * np.random.default_rng(7).standard_normal(500)
    state = MODEL.initial_state(7.0)
    y = MODEL.simulate(np.array([7.0]))
    found, _, _ = MODEL.invert(y + noise, state)
    assert np.ptp(found) <= np.ptp(np.append(noise, 0.0)) / (MODEL.q1 + 2.0 * MODEL.q2 * LOW)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"p": [0.8, -0.4, 0.5]}, "weights p must be >= 0"),
        ({"q1": 0.0, "q2": 0.0}, "with a slope > 0"),
        ({"q1": -0.1}, "must be >= 0"),
        ({"q2": -0.01}, "must be >= 0"),
        ({"b_L": [-6.6, -10.5, -17.5]}, "play 1: gamma_R - r exceeds gamma_L"),
    ],
)
def test_a_model_that_need_not_rise_is_refused(change, complaint):
    fields = {key: value for key, value in MODEL.to_table().items() if key != "kind"}
    with pytest.raises(ValueError, match=complaint):
        GapFreeModel(**{**fields, "r": [0.0, 0.0, 0.5], **change})
