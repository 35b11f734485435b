"""Claims on the analytic inverse of the GPI model: right, not left; clamped, flagged, quiet at rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, claim, gpi_models, histories, scale
from hysteresis_oracles import gpi_inverse, inverse_radii, inverse_weights

from rtctl.hysteresis.gpi import GpiModel, gpi_run
from rtctl.hysteresis.gpi_inverse import GpiInverse, gpi_inverse_run, gpi_inverse_step
from rtctl.interfaces import EstimateStatus

MODEL = GpiModel(
    p=np.array([0.415, 0.648, 0.325, 0.0, 0.081, 0.618]), r=np.arange(6) / 6.0, a_R=1.0, b_R=-7.21, a_L=1.0,
    b_L=-6.61, c=2.0, v_low=LOW, v_high=HIGH,
)  # fmt: skip


@claim
@given(gpi_models())
def test_radii_and_weights_are_equations_nine_to_eleven(model):
    params = GpiInverse.of(model).params
    np.testing.assert_allclose(params.r_hat, inverse_radii(model.p, model.r), atol=1e-12)
    np.testing.assert_allclose(params.p_hat, inverse_weights(model.p), rtol=1e-9, atol=1e-12)


def midway(model):
    """A state after a history, so that the plays are spread: w, v and whether it rose last."""
    w = model.initial_state(LOW)
    gpi_run(w, np.array([8.0, 5.0, 7.5, 6.2]), model.params)
    return w, 6.2, False


@claim
@given(gpi_models(), histories())
def test_the_model_of_the_inverse_gives_y_back(model, v):
    w, v0, rising = midway(model)
    y = model.simulate(v, w)
    inverse = GpiInverse.of(model, u_limit=1.0 - 1e-9)
    found, _, status = inverse.estimate(y, inverse.state_at(w, v0, rising=rising))
    assume(not (status & EstimateStatus.SATURATED).any())
    np.testing.assert_allclose(model.simulate(found, w), y, rtol=0.0, atol=1e-9 * scale(model))


@claim
@given(histories())
def test_the_inverse_is_the_papers_equations_seven_and_eight(v):
    w, v0, rising = midway(MODEL)
    y = np.concatenate((MODEL.simulate(np.array([v0]), w), MODEL.simulate(v, w)))
    inverse = GpiInverse.of(MODEL)
    start = inverse.state_at(w, v0, rising=rising)
    found, _, _ = inverse.estimate(y, start)
    lines = (MODEL.a_R, MODEL.b_R), (MODEL.a_L, MODEL.b_L)
    expected = gpi_inverse(y, v0, start[:6], MODEL.p, MODEL.r, *lines, MODEL.c)
    assume((np.abs(np.diff(y)[np.diff(y) != 0.0]) > 1e-9).all())  # rounding decides no direction
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_between_the_envelopes_the_inverse_of_the_model_is_not_v():
    v = np.concatenate((np.linspace(LOW, 7.5, 100), np.linspace(7.5, 7.2, 50)))
    inverse = GpiInverse.of(MODEL)
    found, _, status = inverse.estimate(MODEL.simulate(v))
    np.testing.assert_allclose(found[2:100], v[2:100], atol=1e-9)
    assert abs(found[-1] - v[-1]) > 0.25  # the input came back 0.3 mA, the output stood still
    assert (status[101:] == EstimateStatus.IN_GAP).all()


def test_plays_started_at_zero_are_wrong_until_a_large_sweep():
    v = np.concatenate(
        (np.linspace(6.0, 7.0, 50), np.linspace(7.0, 6.2, 50), [LOW], np.linspace(LOW, HIGH, 50))
    )
    inverse = GpiInverse.of(MODEL)
    y = MODEL.simulate(v, MODEL.initial_state(6.0))
    proper, _, _ = inverse.estimate(y, inverse.initial_state(6.0))
    zero, _, _ = inverse.estimate(y, np.concatenate((np.zeros(6), [6.0, 1.0])))
    assert abs(proper[25] - v[25]) < 1e-9 < 0.05 < abs(zero[25] - v[25])
    assert abs(zero[-1] - v[-1]) < 1e-9


@claim
@given(st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=30).map(np.array), st.floats(0.0, 5.0))
def test_readings_beyond_the_model_are_clamped_flagged_and_leave_no_memory(parts, excess):
    """A reading beyond the limit must act like one at the limit, or the inner plays would wind up."""
    inverse = GpiInverse.of(MODEL)
    limit = inverse.params.y_limit
    y = MODEL.c + limit * parts
    beyond = np.abs(parts) > 1.0
    found, gain, status = inverse.estimate(np.where(beyond, y + np.sign(parts) * excess, y))
    at_limit, _, _ = inverse.estimate(MODEL.c + np.clip(y - MODEL.c, -limit, limit))
    np.testing.assert_allclose(found, at_limit, atol=1e-7)  # gain 5e5 times rounding
    assert ((status & EstimateStatus.SATURATED)[beyond] != 0).all()
    assert ((status & EstimateStatus.SATURATED)[np.abs(parts) < 1.0] == 0).all()
    assert np.isfinite(gain).all()


@claim
@given(histories(min_size=4), st.floats(1e-4, 0.1), st.integers(0, 2**32 - 1))
def test_noise_within_the_deadband_cannot_flip_the_branch(v, deadband, seed):
    inverse = GpiInverse.of(MODEL, deadband=deadband)
    state = inverse.initial_state(LOW)
    gpi_inverse_run(state, MODEL.simulate(v), inverse.params)
    rest = state[0] + MODEL.c + deadband * np.random.default_rng(seed).uniform(-0.5, 0.5, 50)
    branch = state[-1]
    first = gpi_inverse_step(state, rest[np.argmax(rest * branch)], inverse.params).v
    held, _, status = inverse.estimate(rest, state)
    np.testing.assert_array_equal(held, first)
    assert (status & EstimateStatus.IN_GAP).all()


def test_without_a_deadband_the_same_noise_flips_it():
    inverse = GpiInverse.of(MODEL)
    noise = 1e-3 * np.random.default_rng(7).standard_normal(200)
    y = MODEL.simulate(np.array([LOW, 7.5]))[-1]
    found, _, _ = inverse.estimate(y + noise, inverse.initial_state(7.5))
    assert np.ptp(found) > 0.55  # the gap is 0.6 mA


@claim
@given(gpi_models(), st.floats(5.0, 8.0))
def test_the_gain_bounds_dv_by_dy(model, v):
    inverse = GpiInverse.of(model)
    state = inverse.initial_state(v)
    y, small = model.simulate(np.array([v]))[-1], 1e-6 * model.p[0]
    first = gpi_inverse_step(state, y + small, inverse.params)
    second = gpi_inverse_step(state, y + 2.0 * small, inverse.params)
    assume(first.status == 0 and second.status == 0 and second.gain < 100.0)  # else it bends within a step
    slope = (second.v - first.v) / small
    assert 0.0 < slope <= second.gain / model.p[0] * (1.0 + 1e-3)
    if model.p.size == 1:
        assert slope == pytest.approx(second.gain / model.p[0], rel=1e-3)


def test_a_reading_that_is_not_finite_holds_everything():
    inverse = GpiInverse.of(MODEL)
    state = inverse.initial_state(7.0)
    kept = state.copy()
    for y in (np.nan, np.inf, -np.inf):
        step = gpi_inverse_step(state, y, inverse.params)
        assert (step.v, step.status) == (7.0, EstimateStatus.NOT_FINITE)
    np.testing.assert_array_equal(state, kept)


def test_a_surrogate_beyond_the_identified_range_is_flagged_not_clipped():
    inverse = GpiInverse.of(MODEL)
    y = MODEL.simulate(np.array([LOW, 9.0]))[-1:]
    found, _, status = inverse.estimate(y)
    assert status[0] == EstimateStatus.OUT_OF_RANGE
    assert found[0] == pytest.approx(9.0)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"r": [0.1, 0.5]}, "must rise from 0"),
        ({"r": [0.0, 1.0]}, "below u_limit"),
        ({"p": [0.0, 1.0]}, "partial sum of the weights must be > 0"),
        ({"p": [1.0, -1.5]}, "partial sum of the weights must be > 0"),
    ],
)
def test_a_model_without_an_inverse_is_refused(change, complaint):
    base = {"p": [1.0, 0.5], "r": [0.0, 0.5], "a_R": 1.0, "b_R": -7.2, "a_L": 1.0, "b_L": -6.6, "c": 0.0}
    model = GpiModel(**{**base, **change}, v_low=LOW, v_high=HIGH)
    with pytest.raises(ValueError, match=complaint):
        GpiInverse.of(model)
